"""Configurations as data: a TOML file with the tables `[model]`, `[train]` and `[data]` becomes checked values.

Every field has a default; an unknown or wrong field is an `InputError` that names it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from upt_training.errors import InputError

FEATURE_WIDTH = {
    "displacement": 3,
    "collision": 3,
    "previous_displacement": 3,
    "prior": 3,
    "previous_prior": 3,
    "contact": 1,
}
BASES = ("none", "displacement", "prior")


@dataclass
class GraphSettings:
    """Supernodes and radius graph (docs/reference/formats.md)."""

    radius_mm: float = 12.0
    max_degree: int = 32
    supernodes: int = 512
    seed: int = 7
    domain_fraction: float = 0.0


@dataclass
class ModelSettings:
    """Sizes of the UPT. Widths are multiples of the head counts."""

    features: list[str] = field(default_factory=lambda: ["displacement", "collision"])
    base: str = "none"
    vibration: bool = False  # the linear response goes on swinging when the contact is gone
    mixing: str = "plain"  # "plain", or "differences": the first Linear sees u - L_prev, u - u_prev, L - L_prev
    encoder: int = 96
    encoder_depth: int = 4
    encoder_heads: int = 4
    latent_tokens: int = 64
    latent: int = 128
    latent_heads: int = 4
    approximator_depth: int = 3
    decoder: int = 64
    decoder_heads: int = 2
    mlp_ratio: int = 4
    decoder_mlp_ratio: int = 2
    drop_path: float = 0.0
    relative_positions: bool = False  # a message also sees where its sender lies, seen from the supernode
    graph: GraphSettings = field(default_factory=GraphSettings)

    @property
    def feature_count(self) -> int:
        return sum(FEATURE_WIDTH[name] for name in self.features)

    @property
    def uses_prior(self) -> bool:
        return self.base == "prior" or "prior" in self.features or "previous_prior" in self.features


@dataclass
class TrainSettings:
    """The recipe. `strategy` is `stf` (the paper's), `teacher` (pure teacher forcing) or `replay`."""

    strategy: str = "stf"
    optimiser: str = "lion"
    learning_rate: float = 1.5e-5
    weight_decay: float = 0.0
    warmup_epochs: float = 10.0
    epochs: int = 45
    autoregressive_epochs: int = 15
    steps_per_epoch: int = 0  # 0: one pass over the data
    window: int = 5
    micro_batch: int = 1
    accumulate: int = 4
    clip: float = 1.0
    ema: float = 0.0
    scaled_start: bool = False  # Linear weights start with std fan_in^-1/2; 0.02 is made for wide networks
    input_noise_mm: float = 0.0
    corrupt_contact: float = 0.0  # probability that a contact state is replaced by a corrupted one (replay)
    loss_nodes: int = 0  # nodes decoded and scored a step besides the needed ones; 0: all nodes
    balance_mm2: float = 0.0  # >0: a sample weighs balance / (balance + MSE of its base), so that releases do not drown
    scored_rows: int = 0  # rows a prediction is scored on, drawn anew for each; 0: all of the subset
    drawn_supernodes: int = 0  # supernodes a window is encoded with, drawn anew for each; 0: all
    exact_boundary: bool = False  # held nodes 0 and contact nodes c inside the training rollout
    cuda_graph: bool = False  # on a GPU a window's gradient is one CUDA graph (`stf` and `teacher`, captured.py)
    bf16: bool = False  # bfloat16 products where the device has fast ones
    resident_gb: float = 0.0  # training cases that take no more than this are held in memory; 0: memory-mapped
    seed: int = 1
    evaluate_every: int = 5
    evaluate_cases: int = 10
    patience: int = 0  # evaluations without improvement before stopping; 0: never
    schemes: list[str] = field(default_factory=list)  # empty: all schemes of the data
    train_cases: int = 0  # 0: all

    @property
    def samples_per_step(self) -> int:
        """Predictions that one process scores in an optimiser step."""
        window = {"replay": self.window, "teacher": 1, "stf": self.window - 1}[self.strategy]
        return self.micro_batch * self.accumulate * window


@dataclass
class Settings:
    name: str
    description: str = ""
    model: ModelSettings = field(default_factory=ModelSettings)
    train: TrainSettings = field(default_factory=TrainSettings)

    def to_dict(self) -> dict:
        return dataclasses.asdict(self)

    def model_hash(self) -> str:
        """Identifies a checkpoint's architecture."""
        text = json.dumps(dataclasses.asdict(self.model), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def _fill(kind, values: dict, where: str):
    known = {f.name: f for f in dataclasses.fields(kind)}
    out = {}
    for key, value in values.items():
        if key not in known:
            raise InputError(f"{where}: unknown field {key!r}; known are {', '.join(sorted(known))}")
        if key == "graph":
            value = _fill(GraphSettings, value, f"{where}.graph")
        elif key == "model":
            value = _fill(ModelSettings, value, f"{where}.model")
        elif key == "train":
            value = _fill(TrainSettings, value, f"{where}.train")
        else:
            value = _coerce(known[key].type, value, f"{where}.{key}")
        out[key] = value
    return kind(**out)


def _coerce(kind: str, value, where: str):
    kind = str(kind)
    if kind == "float" and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    accepted = {"int": int, "float": float, "str": str, "bool": bool}.get(kind, list)
    if not isinstance(value, accepted) or (kind == "int" and isinstance(value, bool)):
        raise InputError(f"{where} must be {kind}, found {value!r}")
    return value


def settings_from_dict(values: dict, where: str = "configuration") -> Settings:
    settings = _fill(Settings, values, where)
    model = settings.model
    for name in model.features:
        if name not in FEATURE_WIDTH:
            raise InputError(f"{where}.model.features: {name!r} is not one of {', '.join(FEATURE_WIDTH)}")
    if model.base not in BASES:
        raise InputError(f"{where}.model.base: {model.base!r} is not one of {', '.join(BASES)}")
    if model.vibration and not model.uses_prior:
        raise InputError(f"{where}.model.vibration: needs the linear response as base or among the features")
    for width, heads in (
        ("encoder", "encoder_heads"),
        ("latent", "latent_heads"),
        ("decoder", "decoder_heads"),
    ):
        if getattr(model, width) % getattr(model, heads):
            raise InputError(f"{where}.model.{width} must be a multiple of {heads}")
    if settings.train.strategy not in ("stf", "teacher", "replay"):
        raise InputError(f"{where}.train.strategy must be stf, teacher or replay")
    return settings


def load_settings(path: Path | str) -> Settings:
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: no such configuration")
    try:
        values = tomllib.loads(path.read_text())
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML ({error})") from error
    values.setdefault("name", path.stem)
    return settings_from_dict(values, str(path))
