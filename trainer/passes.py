"""Forward and backward passes of an ensemble of perceptrons by hand: the fast path of all learning on a CPU.

Against autograd this saves the recording of every operation, the allocation of every result (passes that do not
overlap share one small room, which stays in the processor's cache) and the arithmetic nobody needs, such as
gradients of weights that will not be stepped. Products may be taken in bfloat16; master weights, outputs and
everything outside the products stay float32.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from trainer.networks import EnsembleMLP


class Room:
    """Memory for passes that do not overlap: what one leaves, the next one overwrites."""

    def __init__(self, device: torch.device) -> None:
        self.device = device
        self._kept: dict[tuple[str, torch.dtype], Tensor] = {}

    def take(self, name: str, size: tuple[int, ...], dtype: torch.dtype) -> Tensor:
        """A tensor that shares its memory with all of that name."""
        count = math.prod(size)
        kept = self._kept.get((name, dtype))
        if kept is None or len(kept) < count:
            kept = self._kept[name, dtype] = torch.empty(count, dtype=dtype, device=self.device)
        return kept[:count].view(size)


class Layer:
    """One hidden layer's part in a pass of B rows by E members: what it said, and room for the gradient there.

    Rectifying compares bits as integers, whose sign is the number's: exact for every number (a NaN may become 0,
    which is why checkpoints look for those), and several times faster for bfloat16, which would otherwise be
    widened and rounded again.
    """

    def __init__(self, value: Tensor, delta: Tensor, slope: float) -> None:
        self.affine = value
        """What the linear map said, [E, B, width]; the activation overwrites it."""
        self.value = value
        """After the activation, [E, B, width]."""
        self.delta = delta
        """The loss's gradient before the activation, [E, B, width]."""
        self.value_transposed = value.transpose(1, 2)
        self.slope = slope
        integer = torch.int16 if value.dtype == torch.bfloat16 else torch.int32
        self._value_bits, self._delta_bits = value.view(integer), delta.view(integer)

    def activate_(self) -> None:
        if self.slope:
            torch.nn.functional.leaky_relu_(self.value, self.slope)
        else:
            self._value_bits.clamp_min_(0)

    def deactivate_(self) -> None:
        """Turn the gradient after the activation into the one before it."""
        if self.slope:
            backward = torch.ops.aten.leaky_relu_backward.grad_input
            backward(self.delta, self.value, self.slope, True, grad_input=self.delta)
        else:
            backward = torch.ops.aten.threshold_backward.grad_input
            backward(self._delta_bits, self._value_bits, 0, grad_input=self._delta_bits)

    def __getitem__(self, rows: slice) -> Layer:
        return Layer(self.value[:, rows], self.delta[:, rows], self.slope)


class NormalisedLayer(Layer):
    """A layer that is normalised before its activation; mean and 1/deviation of each row stay, [2, E, B, 1]."""

    def __init__(self, affine: Tensor, value: Tensor, delta: Tensor, moments: Tensor, slope: float) -> None:
        super().__init__(value, delta, slope)
        self.affine = affine
        self.moments = moments
        self._units = [value.shape[-1]]

    def activate_(self) -> None:
        self._normalise()
        super().activate_()

    def _normalise(self) -> None:
        value, mean, scale = torch.native_layer_norm(
            self.affine, self._units, None, None, EnsembleMLP.EPSILON
        )
        self.value.copy_(value)
        self.moments[0].copy_(mean)
        self.moments[1].copy_(scale)

    def deactivate_(self) -> None:
        super().deactivate_()
        backward = torch.ops.aten.native_layer_norm_backward
        of_the_input_only = [True, False, False]
        self.delta.copy_(
            backward(self.delta, self.affine, self._units, *self.moments, None, None, of_the_input_only)[0]
        )

    def __getitem__(self, rows: slice) -> NormalisedLayer:
        parts = (self.affine[:, rows], self.value[:, rows], self.delta[:, rows], self.moments[:, :, rows])
        return type(self)(*parts, self.slope)


class PlainlyNormalisedLayer(NormalisedLayer):
    """The same in float32 on a CPU, step by step and in place: PyTorch's own takes half as long again on short rows."""

    def _normalise(self) -> None:
        mean, scale = self.moments
        torch.mean(self.affine, 2, keepdim=True, out=mean)
        torch.sub(self.affine, mean, out=self.value)
        torch.mul(self.value, self.value, out=self.delta)  # which no gradient needs yet
        torch.mean(self.delta, 2, keepdim=True, out=scale)
        self.value.mul_(scale.add_(EnsembleMLP.EPSILON).rsqrt_())


class Memory:
    """What one forward pass of B rows leaves for its backward pass; E members throughout."""

    def __init__(self, inputs: Tensor, hidden: list[Layer], head: Tensor) -> None:
        self.inputs = inputs
        """[E, B, in], in the products' precision."""
        self.hidden = hidden
        self.head = head
        """Room for the last hidden layer in float32, [E, B, width]."""
        self._parts: dict[int, Memory] = {}

    def last(self, count: int) -> Memory:
        """That of the last rows only."""
        if count == self.inputs.shape[1]:
            return self
        rows = slice(-count, None)
        if count not in self._parts:
            hidden = [layer[rows] for layer in self.hidden]
            self._parts[count] = Memory(self.inputs[:, rows], hidden, self.head[:, rows])
        part = self._parts[count]
        part.inputs = self.inputs[:, rows]
        return part


class Passes:
    """One network's passes; its gradient ends up in `network.flat.grad`, as an optimiser expects."""

    def __init__(self, network: EnsembleMLP, precision: torch.dtype, room: Room) -> None:
        self.network = network
        self.precision = precision
        self.room = room
        self._exact = precision == torch.float32
        flat = network.flat.detach()
        # In float32 the products take the weights themselves and write the gradient itself.
        self._weights = flat if self._exact else torch.empty_like(flat, dtype=precision)
        self._layers = network.layers(self._weights)
        self._transposed = [weight.transpose(1, 2) for weight, _ in self._layers]
        self._head = network.layers(flat)[-1]
        self._gradients: list[tuple[Tensor, Tensor]] = []
        self._memory: dict[int, Memory] = {}
        self.refresh()

    def refresh(self) -> None:
        """Take over the network's weights after they have changed."""
        if not self._exact:
            self._weights.copy_(self.network.flat.detach())

    def forward(self, inputs: Tensor) -> Tensor:
        """[B, in] or [E, B, in] → [E, B, out] in float32.

        What `backward` needs is kept until the next pass through the same room.
        """
        self._done = memory = self._remember(inputs)
        x = memory.inputs
        for (weight, bias), layer in zip(self._layers, memory.hidden, strict=False):
            torch.baddbmm(bias, x, weight, out=layer.affine)
            layer.activate_()
            x = layer.value
        return self._outputs(x, memory.head)

    def backward(self, gradient: Tensor, *, learn: bool = True) -> Tensor:
        """From the loss's gradient at the outputs [E, b, out] to that at the first hidden layer [E, b, width].

        It is about the last b rows of the last forward pass. With `learn` the gradient of every weight is
        written, not added, to `network.flat.grad`.
        """
        memory = self._done.last(gradient.shape[1])
        delta = gradient.to(self.precision)
        for index in range(len(memory.hidden), 0, -1):
            below = memory.hidden[index - 1]
            if learn:
                self._learn(index, below.value_transposed, delta)
            _times(delta, self._transposed[index], out=below.delta)
            below.deactivate_()
            delta = below.delta
        if learn:
            self._learn(0, memory.inputs.transpose(1, 2), delta)
            self._hand_over()
        return delta

    def input_gradient(self, delta: Tensor, columns: slice) -> Tensor:
        """The loss's gradient at some of the inputs, [E, b, columns], from what `backward` returned."""
        return torch.bmm(delta, self._transposed[0][:, :, columns]).float()

    def _outputs(self, hidden: Tensor, head: Tensor) -> Tensor:
        """The last layer in float32; with one output it is a weighted sum, and no matrix to multiply by."""
        weight, bias = self._head
        exact = hidden if self._exact else head.copy_(hidden)
        if weight.shape[2] == 1:
            return torch.mul(exact, weight.transpose(1, 2), out=head).sum(2, keepdim=True).add_(bias)
        return torch.baddbmm(bias, exact, weight)

    def _learn(self, index: int, below_transposed: Tensor, delta: Tensor) -> None:
        """Write the gradient of one layer's weights."""
        if not self._gradients:
            self._gradients = self._room_for_gradients()
        weight, bias = self._gradients[index]
        _product(below_transposed, delta, out=weight)
        torch.sum(delta, 1, keepdim=True, out=bias)

    def _room_for_gradients(self) -> list[tuple[Tensor, Tensor]]:
        flat = self.network.flat
        flat.grad = torch.zeros_like(flat, requires_grad=False)
        self._rounded = flat.grad if self._exact else torch.zeros_like(self._weights)
        return self.network.layers(self._rounded)

    @property
    def gradient(self) -> Tensor:
        """What the last `backward` wrote, in the order of `network.flat`."""
        assert self.network.flat.grad is not None, "no backward pass yet"
        return self.network.flat.grad

    def _hand_over(self) -> None:
        """What was written in the products' precision becomes the gradient."""
        if not self._exact:
            self.gradient.copy_(self._rounded)

    # Memory --------------------------------------------------------------------------------------

    def _remember(self, inputs: Tensor) -> Memory:
        count = inputs.shape[-2]
        memory = self._memory.get(count)
        if memory is None:
            memory = self._memory[count] = self._new_memory(count)
        if self._exact:
            memory.inputs = inputs.expand(self.network.members, *inputs.shape[-2:])
        else:
            memory.inputs.copy_(inputs)
        return memory

    def _new_memory(self, count: int) -> Memory:
        inputs, *widths, _ = self.network.sizes
        hidden = [self._new_layer(index, count, width) for index, width in enumerate(widths)]
        head = self.room.take("head", (self.network.members, count, widths[-1]), torch.float32)
        return Memory(self._take("inputs", count, inputs), hidden, head)

    def _new_layer(self, index: int, count: int, width: int) -> Layer:
        value, slope = self._take(f"hidden {index}", count, width), self.network.slope
        delta = self._take(f"delta {index % 2}", count, width)  # neighbouring layers' do not share their room
        if not self.network.normalised:
            return Layer(value, delta, slope)
        affine = self._take(f"affine {index}", count, width)
        # PyTorch keeps them in the values' precision on a CPU, and always exactly on a GPU.
        on_cpu = self.room.device.type == "cpu"
        kept = self.precision if on_cpu else torch.float32
        moments = self.room.take(f"moments {index}", (2, self.network.members, count, 1), kept)
        kind = PlainlyNormalisedLayer if on_cpu and self._exact else NormalisedLayer
        return kind(affine, value, delta, moments, slope)

    def _take(self, name: str, count: int, width: int) -> Tensor:
        return self.room.take(name, (self.network.members, count, width), self.precision)


def _times(delta: Tensor, weight: Tensor, *, out: Tensor) -> None:
    """delta [E, B, k] · weight [E, k, n]; with k = 1 nothing is summed."""
    if delta.shape[2] == 1:
        torch.mul(delta, weight, out=out)
    else:
        _product(delta, weight, out=out)


def _product(left: Tensor, right: Tensor, *, out: Tensor) -> None:
    """[E, m, k] · [E, k, n]; a single member's is spared the copy that `bmm` makes of transposed factors."""
    if len(left) == 1:
        torch.mm(left[0], right[0], out=out[0])
    else:
        torch.bmm(left, right, out=out)
