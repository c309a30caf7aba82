"""The web application: one function puts its parts together."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Collection
from contextlib import AbstractAsyncContextManager, asynccontextmanager

from fastapi import FastAPI
from starlette.routing import Mount

from labels_db.data_folder import DataFolder
from server import (
    api_commands,
    api_experiments,
    api_records,
    api_runs,
    artifacts,
    compare_page,
    dashboard,
    errors,
    experiment_page,
    labelling,
    run_page,
    sign_in,
)
from server.access_log import AccessLog
from server.admission import Admission
from server.security import Gate
from server.services import Services
from server.templating import WEB, VersionedFiles, make_templates, static_version
from server.token import TokenFile

ROUTERS = (
    sign_in.router,
    api_runs.router,
    api_commands.router,
    api_records.router,
    api_experiments.router,
    dashboard.router,
    run_page.router,
    experiment_page.router,
    compare_page.router,
    artifacts.router,
    labelling.router,
)


def create_app(data: DataFolder, *, hosts: Collection[str] = ()) -> FastAPI:
    """The application on one data folder; `hosts` are names it answers to besides this machine's own."""
    app = FastAPI(
        title="Pebble",
        description="Teach a simulated robot by choosing between pairs of one-second clips.",
        openapi_url="/api/openapi.json",
        docs_url=None,  # FastAPI's documentation pages load scripts from elsewhere
        redoc_url=None,
        lifespan=_lifespan(data),
    )
    version = static_version()
    app.state.templates = make_templates(version)
    app.state.admission = Admission(TokenFile(data))
    for router in ROUTERS:
        app.include_router(router)
    app.get("/healthz", include_in_schema=False)(health)
    app.router.routes.append(Mount(f"/static/{version}", VersionedFiles(directory=WEB / "static")))
    errors.install(app)
    app.add_middleware(Gate, admission=app.state.admission, hosts=hosts, refuse=errors.complain)
    app.add_middleware(AccessLog)
    return app


def health() -> dict[str, str]:
    """Says that the server answers."""
    return {"status": "ok"}


def _lifespan(data: DataFolder) -> Callable[[FastAPI], AbstractAsyncContextManager[None]]:
    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with data.open_database() as database:
            app.state.services = Services(data=data, database=database, store=data.open_store())
            yield

    return lifespan
