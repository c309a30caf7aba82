FROM python:3.11-slim-bookworm

# Rendering without a screen: EGL, or OSMesa where that fails.
RUN apt-get update \
    && apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri libopengl0 libosmesa6 \
    && rm -rf /var/lib/apt/lists/*

RUN useradd --create-home --uid 1000 pebble && install --directory --owner=pebble --group=pebble /data

# The CPU builds of torch: the others bring gigabytes of CUDA. Before any code, so that this layer is kept.
RUN pip install --no-cache-dir --index-url https://download.pytorch.org/whl/cpu 'torch>=2.6,<2.14'

WORKDIR /app
COPY . .
RUN pip install --no-cache-dir '.[trainer,export,metaworld,classic,experiments]'

USER pebble
ENV PEBBLE_DATA=/data PYTHONUNBUFFERED=1
VOLUME /data
EXPOSE 8000
CMD ["pebble", "serve", "--host", "0.0.0.0"]
