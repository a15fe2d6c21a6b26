"""The surface as an unknown of a campaign, in as few numbers as the motions and the effects feel.

With ``A`` the normal matrix of the surface alone (its prior, the views' and all frames' single samples) and ``B`` its cross terms with
everything else that is unknown, the surface answers to a change of those by ``-A^-1 B``: within the span of that answer nothing of the
eliminated equations is lost [Galerkin's condition; Triggs et al., Bundle adjustment, 2000, section 6.1]. The moves that span it are made
independent of one another under what prior and views know, each with a standard deviation of one, and those that frames do not feel are
left out. They are then parameters like any other: shared by all sequences of one particle, with a normal prior about what views and prior
alone prefer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array, vstack
from scipy.sparse.linalg import LinearOperator, aslinearoperator

from datasets.vocabulary.body import Body
from estimator.particle.particle import Particle
from estimator.surface.arrow import Noise, Weighed, filled, weighed
from estimator.surface.dissection import Factor, factorised
from estimator.surface.evenness import Believed, believed
from estimator.surface.mass import N_MASS, mass_response
from estimator.surface.samples import views_of
from estimator.surface.shape import Shape
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
LEAST_FELT = 0.01
"""Information that frames must give on a move beside a prior of one: without such a move variances are less than a percent too small."""
ROUNDING = 1e-9
"""Share of the largest variance below which a combination of moves is none."""


@dataclass(frozen=True)
class Felt:
    """What one sequence's residuals feel, all in standard deviations.

    ``by_corner`` (r, 3 n): by each corner's coordinates; ``by_motion`` (r, p): by its own parameters and those that it shares. ``samples``
    (s, 3 n): what single samples feel, of which residuals are means.
    """

    by_corner: csr_array
    by_motion: Float[NDArray[np.float64], "r p"]
    samples: csr_array


@dataclass(frozen=True, eq=False)
class Amplitudes:
    """Moves of a ``surface``: ``moves`` (3 n, m) m of its corners by one standard deviation of each amplitude.

    ``mass`` (8, 1 + m): centre of mass (m) and inertia as deviations from the nominal body, in its axes, and their derivatives.
    """

    surface: Surface
    moves: Float[NDArray[np.float64], "3n m"]
    mass: Float[NDArray[np.float64], "8 1m"]

    @classmethod
    def none(cls, surface: Surface) -> "Amplitudes":
        """Of a surface that nothing moves; nothing is said of mass properties."""
        return cls(surface, np.zeros((surface.vertices.size, 0)), np.zeros((N_MASS, 1)))

    @property
    def count(self) -> int:
        """How many there are."""
        return self.moves.shape[1]

    def surface_at(self, amplitude: Array) -> Surface:
        """The surface moved by an ``amplitude`` (m,)."""
        return self.surface.moved((self.moves @ amplitude).reshape(-1, 3))

    def scaled(self, scale: float) -> "Amplitudes":
        """With standard deviations that are ``scale`` times as large."""
        return Amplitudes(self.surface, self.moves * scale, np.column_stack([self.mass[:, 0], self.mass[:, 1:] * scale]))

    def padded(self, count: int) -> "Amplitudes":
        """With amplitudes that move nothing, up to a ``count`` of them."""
        more = count - self.count
        if not more:
            return self
        return Amplitudes(self.surface, np.pad(self.moves, ((0, 0), (0, more))), np.pad(self.mass, ((0, 0), (0, more))))


@dataclass(frozen=True)
class Shown:
    """What prior and calibrated views say of a surface's unknowns (u,), views marginal over how they are moved.

    ``information`` (u, u), of which moves of views take ``lost`` (k, u) squared; ``gradient`` (u,).
    """

    information: LinearOperator
    lost: Float[NDArray[np.float64], "k u"]
    gradient: Float[NDArray[np.float64], " u"]


def shown(prior: Believed, views: Weighed, known: Float[NDArray[np.float64], "k k"], pull: Float[NDArray[np.float64], " k"]) -> Shown:
    """By a ``prior`` and ``views`` with k moves, of which ``known`` and ``pull``, its gradient, are what is known otherwise."""
    among, by_move = filled(views.F.T @ views.F) + known, filled(views.F.T @ views.J)
    root = np.linalg.cholesky(among)
    lost, off = (solve_triangular(root, each, lower=True) for each in (by_move, views.F.T @ views.r + pull))
    unmoved = aslinearoperator(csr_array(prior.rows.T @ prior.rows + views.J.T @ views.J))
    gradient = prior.rows.T @ prior.values + views.J.T @ views.r - lost.T @ off
    return Shown(unmoved - aslinearoperator(lost.T) @ aslinearoperator(lost), lost, gradient)


def amplitudes_of(
    particle: Particle, body: Body, shape: Shape, felt: Sequence[Felt], *, huber: float, views_px: float = 0.0, most: int | None = None
) -> tuple[Amplitudes, Float[NDArray[np.float64], " m"]]:
    """The amplitudes of a particle's surface that its sequences feel, and those (m,) of the ``shape``'s own surface.

    ``shape``: the surface about which views and frames are linear, and the noise of the views' samples; ``body``: the nominal one, in whose
    axes mass properties are; ``huber``: standard deviations beyond which a sample's influence stays constant; ``views_px``: by how much the
    views' outlines are drawn too large. Those that are felt most, ``most`` of them at most.
    """
    surface = shape.surface
    prior = believed(surface)
    moved = views_of(particle, views_px)
    views = weighed(moved.samples(surface), prior, Noise.white(shape.noise_px), huber)
    known = shown(prior, views, moved.information, np.zeros(len(moved.unknown)))
    rows = [csr_array(each.by_corner @ prior.basis) for each in felt]
    every = csr_array(vstack(rows))
    frames = csr_array(every.T @ every)
    border = np.column_stack([J.T @ each.by_motion for J, each in zip(rows, felt, strict=True)])
    single = csr_array(vstack([each.samples for each in felt]) @ prior.basis)
    factor = factorised(csr_array(vstack([prior.rows, views.J, single])), prior.corner, prior.sphere)
    kept, _ = independent(answers_beside(factor, _scaled(border), known.lost.T), known.information, frames)
    kept = kept if most is None else kept[:, -most:]
    here = kept.T @ known.gradient
    moves = np.asarray(prior.basis @ kept)
    mass = mass_response(surface, body)
    by_amplitude = mass.by_corner.T @ moves
    preferred = surface.moved((moves @ -here).reshape(-1, 3))
    return Amplitudes(preferred, moves, np.column_stack([mass.values - by_amplitude @ here, by_amplitude])), np.asarray(here)


def answers_beside(factor: Factor, border: Array, lost: Array) -> Array:
    """How the surface answers to each column of ``border`` (u, p), less ``lost`` (u, k) squared of its ``factor`` [Woodbury's identity]."""
    p = border.shape[1]
    solved = factor.solve(np.column_stack([border, lost]))
    by, answers = solved[:, p:], solved[:, :p]
    return np.asarray(answers + by @ np.linalg.solve(np.eye(lost.shape[1]) - lost.T @ by, lost.T @ answers))


def _scaled(border: Array) -> Array:
    """Columns of length one, without those that are none."""
    size = np.linalg.norm(border, axis=0)
    return np.asarray(border[:, size > 0.0] / size[size > 0.0])


def independent(
    answers: Float[NDArray[np.float64], "u p"], known: csr_array | LinearOperator, frames: csr_array
) -> tuple[Float[NDArray[np.float64], "u m"], Float[NDArray[np.float64], " m"]]:
    """Combinations of ``answers`` that are independent with variance one under ``known`` (u, u) and that ``frames`` (u, u) feel.

    And by how much these feel each (m,): by their information, in which they are independent, too.
    """
    products = answers.T @ (known @ answers)
    size = np.sqrt(np.diag(products))
    answers = answers / size
    value, vector = np.linalg.eigh(products / np.outer(size, size))
    there = value > ROUNDING * value[-1]
    whitened = answers @ (vector[:, there] / np.sqrt(value[there]))
    information, turn = np.linalg.eigh(whitened.T @ (frames @ whitened))
    felt = information > LEAST_FELT
    return np.asarray(whitened @ turn[:, felt]), np.asarray(information[felt])
