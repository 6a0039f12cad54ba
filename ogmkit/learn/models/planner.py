"""The encoder–decoder LSTM that plans (paper, Encoder-decoder LSTM for trajectory planning)."""

import torch
from torch import Tensor, nn

from ogmkit.base.steps import STEPS as DESTINATION
from ogmkit.errors import SettingsError
from ogmkit.learn.models.gaussian import Gaussians, gaussian_of
from ogmkit.learn.models.linear_mean import LinearMean
from ogmkit.learn.models.standard import Standard
from ogmkit.metrics.plan import STEPS

EMBEDDING = 64
_PARAMETERS = 5


def polar(points: Tensor) -> Tensor:
    """Distance and direction of (..., 2) points x, y: (..., 2) r and α, α = atan2(y, x), 0 at the origin."""
    angle = torch.atan2(points[..., 1], points[..., 0])
    return torch.stack([torch.linalg.vector_norm(points, dim=-1), angle], dim=-1)


class Planner(nn.Module):
    """From features and positions at t = −5 … 0, and a destination, to positions at +1 … +5.

    One that isn't told the destination, the position at +6, predicts it as well.

    The paper's two recurrences. The encoder embeds features and position of each time step (φ_e, φ_a); its
    last hidden and cell state begin the decoder, which embeds its own last mean (φ′_a), from the ego at
    (0, 0) on, and maps its hidden state and the destination's polar coordinates to a Gaussian (φ_s).
    Embeddings are a linear layer and ReLU; φ_s has one hidden layer of the same width, since a linear map
    could not turn an angle into a place. Coordinates are standardised by the training split, going in and
    coming out (`fit`): a car's places across its way differ by centimetres, along it by tens of metres.

    On a linear mean it learns what that leaves over: φ_s then gives the mean's distance from the linear plan,
    standardised as such. The decoder still embeds the whole mean, in the standardisation of places.

    Args:
        features: numbers a time step; 0 for a planner that sees none.
        past: whether it is told the ego's past positions.
        hidden: size of both LSTMs' states.
        linear_mean: whether its means are learnt on top of the training split's linear plan.
        told: whether it is told the destination.

    Attributes:
        points: T, that it predicts: 5, or 6 where it isn't told the last one.

    Raises:
        SettingsError: it would see nothing at all, or its linear mean no past.
    """

    def __init__(
        self,
        features: int,
        *,
        past: bool = True,
        hidden: int = 128,
        linear_mean: bool = False,
        told: bool = True,
    ) -> None:
        super().__init__()
        if not features and not past:
            raise SettingsError("a planner without features needs the past: leave out --no-past")
        if linear_mean and not past:
            raise SettingsError("a linear mean is one of the past: leave out --no-past")
        self.points = STEPS if told else DESTINATION
        self.embed_features = _embedding(features) if features else None
        self.embed_position = _embedding(2) if past else None
        self.encoder = nn.LSTM(EMBEDDING * (bool(features) + past), hidden, batch_first=True)
        self.embed_estimate = _embedding(2)
        self.decoder = nn.LSTMCell(EMBEDDING, hidden)
        self.head = nn.Sequential(_embedding(hidden + 2 * told), nn.Linear(EMBEDDING, _PARAMETERS))
        self.of_positions, self.of_targets = Standard(), Standard()
        self.of_destination = Standard() if told else None
        self.linear_mean = LinearMean(self.points, told=told) if linear_mean else None

    def fit(self, positions: Tensor, future: Tensor) -> None:
        """Learn the coordinates' fixed means and spreads, and the linear mean where there is one.

        Args:
            positions: (N, 6, 2) metres, of all training sequences.
            future: (N, 6, 2) metres, the destination last.
        """
        self.of_positions.fit(positions)
        destination, points = future[:, STEPS], future[:, : self.points]
        if self.of_destination is not None:
            self.of_destination.fit(polar(destination))
        self.of_targets.fit(points)
        if self.linear_mean is not None:
            told = None if self.of_destination is None else destination
            self.linear_mean.fit(positions, told, points)

    def forward(
        self, features: Tensor | None, positions: Tensor | None, destination: Tensor | None
    ) -> Gaussians:
        """Plan.

        Args:
            features: (B, 6, F), oldest first; None for a planner that sees none.
            positions: (B, 6, 2) metres in the last one's level frame; not looked at without past.
            destination: (B, 2) metres in the same frame; None where it isn't told.

        Returns:
            (B, T) distributions in the same frame.
        """
        parts: list[Tensor] = []
        if self.embed_features is not None and features is not None:
            parts.append(self.embed_features(features))
        if self.embed_position is not None and positions is not None:
            parts.append(self.embed_position(self.of_positions(positions)))
        _, (hidden, cell) = self.encoder(torch.cat(parts, dim=-1))
        state = hidden[0], cell[0]
        base, unit = self._base(positions, destination)
        place = self._place(destination)
        estimate = self.of_targets.mean.new_zeros(len(hidden[0]), 2)
        found: list[tuple[Tensor, Tensor, Tensor]] = []
        for step in range(self.points):
            state = self.decoder(self.embed_estimate(self.of_targets(estimate)), state)
            raw = self.head(torch.cat([state[0], *place], dim=-1))
            found.append(gaussian_of(raw, base[step] + unit.mean, unit.spread))
            estimate = found[-1][0]
        mean, sigma, rho = (torch.stack(values, dim=1) for values in zip(*found, strict=True))
        return Gaussians(mean, sigma, rho)

    def _place(self, destination: Tensor | None) -> tuple[Tensor, ...]:
        """(B, 2) standardised polar coordinates, where the destination is told."""
        if self.of_destination is None or destination is None:
            return ()
        return (self.of_destination(polar(destination)),)

    def _base(self, positions: Tensor | None, destination: Tensor | None) -> tuple[Tensor, Standard]:
        """What the head's means are added to, (T, B, 2) or (T, 2) metres, and what they are the units of."""
        if self.linear_mean is None or positions is None:
            return self.of_targets.mean.new_zeros(self.points, 2), self.of_targets
        return self.linear_mean(positions, destination).transpose(0, 1), self.linear_mean.of_residuals


def _embedding(inputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, EMBEDDING), nn.ReLU())
