"""The encoder–decoder LSTM that plans (paper, Encoder-decoder LSTM for trajectory planning)."""

import torch
from torch import Tensor, nn

from ogmkit.errors import SettingsError
from ogmkit.learn.models.gaussian import Gaussians, gaussian_of
from ogmkit.metrics.plan import STEPS

EMBEDDING = 64
_PARAMETERS = 5
_LEAST_SPREAD = 1e-3
"""What hardly varies is not blown up."""


def polar(points: Tensor) -> Tensor:
    """Distance and direction of (..., 2) points x, y: (..., 2) r and α, α = atan2(y, x), 0 at the origin."""
    angle = torch.atan2(points[..., 1], points[..., 0])
    return torch.stack([torch.linalg.vector_norm(points, dim=-1), angle], dim=-1)


class Standard(nn.Module):
    """Fixed means and spreads of two coordinates, by which a network sees numbers of about ±1.

    Attributes:
        mean: (2,).
        spread: (2,), standard deviations.
    """

    mean: Tensor
    spread: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(2))
        self.register_buffer("spread", torch.ones(2))

    def fit(self, values: Tensor) -> None:
        """Take the statistics of (..., 2) values, in float64."""
        flat = values.reshape(-1, 2).double()
        self.mean.copy_(flat.mean(0))
        self.spread.copy_(flat.std(0, correction=0).clamp(min=_LEAST_SPREAD))

    def forward(self, values: Tensor) -> Tensor:
        """(..., 2) standardised."""
        return (values - self.mean) / self.spread


class Planner(nn.Module):
    """From features and positions at t = −5 … 0, and a destination, to positions at +1 … +5.

    The paper's two recurrences. The encoder embeds features and position of each time step (φ_e, φ_a); its
    last hidden and cell state begin the decoder, which embeds its own last mean (φ′_a), from the ego at
    (0, 0) on, and maps its hidden state and the destination's polar coordinates to a Gaussian (φ_s).
    Embeddings are a linear layer and ReLU; φ_s has one hidden layer of the same width, since a linear map
    could not turn an angle into a place. Coordinates are standardised by the training split, going in and
    coming out (`fit`): a car's places across its way differ by centimetres, along it by tens of metres.

    Args:
        features: numbers a time step; 0 for a planner that sees none.
        past: whether it is told the ego's past positions.
        hidden: size of both LSTMs' states.

    Raises:
        SettingsError: it would see nothing at all.
    """

    def __init__(self, features: int, *, past: bool = True, hidden: int = 128) -> None:
        super().__init__()
        if not features and not past:
            raise SettingsError("a planner without features needs the past: leave out --no-past")
        self.embed_features = _embedding(features) if features else None
        self.embed_position = _embedding(2) if past else None
        self.encoder = nn.LSTM(EMBEDDING * (bool(features) + past), hidden, batch_first=True)
        self.embed_estimate = _embedding(2)
        self.decoder = nn.LSTMCell(EMBEDDING, hidden)
        self.head = nn.Sequential(_embedding(hidden + 2), nn.Linear(EMBEDDING, _PARAMETERS))
        self.of_positions, self.of_destination, self.of_targets = Standard(), Standard(), Standard()

    def fit(self, positions: Tensor, future: Tensor) -> None:
        """Learn the coordinates' fixed means and spreads.

        Args:
            positions: (N, 6, 2) metres, of all training sequences.
            future: (N, 6, 2) metres, the destination last.
        """
        self.of_positions.fit(positions)
        self.of_destination.fit(polar(future[:, STEPS]))
        self.of_targets.fit(future[:, :STEPS])

    def forward(self, features: Tensor | None, positions: Tensor | None, destination: Tensor) -> Gaussians:
        """Plan.

        Args:
            features: (B, 6, F), oldest first; None for a planner that sees none.
            positions: (B, 6, 2) metres in the last one's level frame; not looked at without past.
            destination: (B, 2) metres in the same frame.

        Returns:
            (B, 5) distributions in the same frame.
        """
        parts: list[Tensor] = []
        if self.embed_features is not None and features is not None:
            parts.append(self.embed_features(features))
        if self.embed_position is not None and positions is not None:
            parts.append(self.embed_position(self.of_positions(positions)))
        _, (hidden, cell) = self.encoder(torch.cat(parts, dim=-1))
        state = hidden[0], cell[0]
        place = self.of_destination(polar(destination))
        estimate = torch.zeros_like(destination)
        found: list[tuple[Tensor, Tensor, Tensor]] = []
        for _ in range(STEPS):
            state = self.decoder(self.embed_estimate(self.of_targets(estimate)), state)
            raw = self.head(torch.cat([state[0], place], dim=-1))
            found.append(gaussian_of(raw, self.of_targets.mean, self.of_targets.spread))
            estimate = found[-1][0]
        mean, sigma, rho = (torch.stack(values, dim=1) for values in zip(*found, strict=True))
        return Gaussians(mean, sigma, rho)


def _embedding(inputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, EMBEDDING), nn.ReLU())
