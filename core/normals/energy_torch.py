"""The normal energy differentiated by torch, which is imported on the first call and never before."""

import sys
from importlib.util import find_spec

import numpy as np

from ..errors import MissingDependency
from ..settings import Settings
from .energy import NormalEnergy


def uses_torch(settings: Settings) -> bool:
    """Whether the energy is differentiated by torch: where that is asked for or, unless NumPy is, installed."""
    wanted = settings.backend == "auto" and (settings.device == "cuda" or find_spec("torch") is not None)
    return wanted or settings.backend == "torch"


def torch_device(wanted: str) -> str:
    """The device that torch is to use, "cpu" or "cuda", where `wanted` is one of these or "auto".

    Raises :class:`MissingDependency` where torch is not installed, or sees no GPU and one is wanted.
    """
    torch = _torch()
    if wanted == "cuda" and not torch.cuda.is_available():
        raise MissingDependency(
            f"device is 'cuda' and torch {torch.__version__} sees no Nvidia GPU; install its driver and a torch made "
            "for CUDA, or use device 'cpu'"
        )
    if wanted == "auto":
        return "cuda" if torch.cuda.is_available() else "cpu"
    return wanted


def torch_value_and_gradient(energy: NormalEnergy, device: str = "cpu"):
    """What `energy.value_and_gradient` does, by autograd, on `device`, "cpu" or "cuda".

    Raises :class:`MissingDependency` where torch is not installed.
    """
    torch = _torch()
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


def _torch():
    try:
        import torch
    except ImportError as error:
        raise MissingDependency(
            f'torch is not installed; run "{sys.executable}" -m pip install torch, or use backend "numpy" and device '
            '"cpu"'
        ) from error
    return torch
