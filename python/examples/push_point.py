"""A Gymnasium environment: move a point inside the tissue to a place with a ball that presses on the surface.

    pip install "./python[examples]"
    python python/examples/push_point.py --bundle onnx/brain-coarse-reduced

plays the environment with a random policy and with a linear one that it learns by the cross-entropy method
(seconds). It learns in steps of one correction, which are fast, and plays in those of the bundle, which are accurate.
Lengths in mm; a step is `model.dt` (50 ms of tissue).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import numpy as np
import upt

ROOT = Path(__file__).resolve().parents[2]


class PushPoint(gymnasium.Env):
    """Observation `[9]`: where the point is, where it should be, how far the ball is from where it began. Action `[3]`:
    how the ball moves in this step, at most `reach` mm along each axis. Reward: minus the distance that is left, mm.

    The ball begins where it touches the site in the middle of the domain; the point lies `depth` mm below that site.
    `corrections`: as in `upt.SceneOptions`; 0: as many as the bundle recommends.
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        model: upt.Model,
        radius: float = 6.0,
        friction: float = 1.0,
        depth: float = 6.0,
        reach: float = 1.0,
        push: float = 8.0,
        steps: int = 20,
        corrections: int | str = 0,
    ) -> None:
        self.scene = model.scene(corrections=corrections, threads=1)  # environments run side by side
        self.reach, self.push, self.steps = reach, push, steps
        rest, domain, faces = model.positions, model.domain_nodes, model.domain_faces
        site = rest[domain[np.argmin(np.linalg.norm(rest[domain] - rest[domain].mean(axis=0), axis=1))]]
        # Inward: away from the mean normal of the faces that the ball will touch.
        near = rest[faces][np.linalg.norm(rest[faces].mean(axis=1) - site, axis=1) < 2 * radius]
        normal = np.cross(near[:, 1] - near[:, 0], near[:, 2] - near[:, 0]).sum(axis=0)
        self.inward = -normal / np.linalg.norm(normal)
        self.start = site - radius * self.inward
        self.ball = upt.Instrument.capsule(radius, friction=friction)
        self.scene.attach_points((site + depth * self.inward)[None])
        self.scene.set_region(domain[:1])  # nothing but the point is looked at
        limit = np.full(9, 4.0 * push, np.float32)
        self.observation_space = gymnasium.spaces.Box(-limit, limit)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (3,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        # A place that can be reached: where a press of the ball takes the point.
        press = self.push * (0.7 * self.inward + 0.4 * self.np_random.uniform(-1.0, 1.0, 3))
        self.scene.reset()
        for part in np.linspace(0.0, 1.0, 6):
            self._step(part * press)
        self.goal = self.scene.read(view="points")[0].copy()
        self.scene.reset()
        self.moved, self.time = np.zeros(3), 0
        return self._observe(), {}

    def step(self, action):
        self.moved = np.clip(self.moved + self.reach * np.clip(action, -1.0, 1.0), -self.push, self.push)
        try:
            self._step(self.moved)
        except upt.GuardError:  # far beyond what the model knows: the state is the last good one, and the episode ends
            return self._observe(), -self.push, False, True, {"left_mm": self.push, "force_mn": 0.0}
        self.time += 1
        left = float(np.linalg.norm(self._point() - self.goal))
        force = float(np.linalg.norm(self.scene.readings()[0].force))
        return self._observe(), -left, False, self.time >= self.steps, {"left_mm": left, "force_mn": force}

    def close(self):
        self.scene.close()

    def _step(self, moved: np.ndarray) -> None:
        self.ball.position = self.start + moved
        self.scene.step([self.ball])

    def _point(self) -> np.ndarray:
        return self.scene.read(view="points")[0] if self.time else np.zeros(3, np.float32)

    def _observe(self) -> np.ndarray:
        return np.concatenate([self._point(), self.goal, self.moved]).astype(np.float32)


class LinearPolicy:
    """`action = W (goal - point)`, `W [3, 3]`, 1/mm."""

    def __init__(self, weights: np.ndarray) -> None:
        self.weights = weights.reshape(3, 3)

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        return np.clip(self.weights @ (observation[3:6] - observation[:3]), -1.0, 1.0)


def play(environment: PushPoint, policy, seeds) -> float:
    """Distance left at the end of an episode, mm: mean over `seeds`."""
    left = []
    for seed in seeds:
        observation, _ = environment.reset(seed=seed)
        done = False
        while not done:
            observation, _, _, done, info = environment.step(policy(observation))
        left.append(info["left_mm"])
    return float(np.mean(left))


def learn(
    environment: PushPoint, rounds: int = 12, population: int = 16, elite: int = 4, seed: int = 0
) -> LinearPolicy:
    """Cross-entropy method over the nine weights, three episodes a candidate."""
    draw = np.random.default_rng(seed)
    mean, spread = np.zeros(9), np.full(9, 0.5)
    for turn in range(rounds):
        candidates = mean + spread * draw.standard_normal((population, 9))
        scores = [play(environment, LinearPolicy(w), range(3 * turn, 3 * turn + 3)) for w in candidates]
        best = candidates[np.argsort(scores)[:elite]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.05
    return LinearPolicy(mean)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bundle", default=str(ROOT / "onnx/brain-coarse-reduced"))
    parser.add_argument("--rounds", type=int, default=12)
    arguments = parser.parse_args()

    model = upt.Model(arguments.bundle)
    environment = PushPoint(model)
    held_out = range(10_000, 10_020)
    environment.action_space.seed(0)
    random = play(environment, lambda _: environment.action_space.sample(), held_out)
    learned = play(environment, learn(PushPoint(model, corrections=1), arguments.rounds), held_out)
    print(f"distance left: random policy {random:.2f} mm, learned policy {learned:.2f} mm")


if __name__ == "__main__":
    main()
