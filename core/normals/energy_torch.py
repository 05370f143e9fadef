"""The normal energy differentiated by torch, which is imported on the first call and never before."""

import numpy as np

from ..errors import MissingDependency
from .energy import NormalEnergy


def torch_value_and_gradient(energy: NormalEnergy):
    """What `energy.value_and_gradient` does, by autograd, on the GPU where torch sees one.

    Raises :class:`MissingDependency` where torch is not installed.
    """
    try:
        import torch
    except ImportError as error:
        raise MissingDependency(
            "backend is 'torch', which is not installed; pip install torch, or use numpy"
        ) from error

    device = "cuda" if torch.cuda.is_available() else "cpu"
    site, other, from_site, from_other, weight, owner, direction, scales = (
        torch.as_tensor(array, device=device)
        for array in (
            energy.site, energy.other, energy.from_site, energy.from_other,
            energy.weight, energy.owner, energy.direction, energy.scales,
        )
    )  # fmt: skip

    def evaluate(normals: np.ndarray) -> tuple[float, np.ndarray]:
        axes = torch.tensor(normals, device=device, requires_grad=True)
        n_i, n_j = axes.index_select(0, site), axes.index_select(0, other)
        height_i, height_j = (n_i * from_site).sum(1), (n_j * from_other).sum(1)
        gap = (height_i.abs() - height_j.abs()).abs()
        turn = height_i.sign()[:, None] * n_i - height_j.sign()[:, None] * n_j
        deviation = (axes.index_select(0, owner) * direction).sum(1) - (1.0 if energy.printed_alignment else 0.0)
        terms = weight @ gap, weight @ torch.linalg.vector_norm(turn, dim=1), deviation @ deviation
        value = scales @ torch.stack(terms)
        value.backward()
        return value.item(), axes.grad.cpu().numpy()

    return evaluate
