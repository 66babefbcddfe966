"""How large the experiments are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Cone(NamedTuple):
    """The friction cones of all experiments, as in the paper."""

    friction: float = 1.0
    edges: int = 8


PAPERS_CONE = Cone()


@dataclass(frozen=True)
class Scale:
    """Sizes of the experiments of Sec. IV. Friction 1 and 8 edges throughout, as in the paper."""

    name: str
    #: Pieces and grasps per piece of the uniform samples of D(1) (IV.A).
    survey_pieces: int
    survey_grasps: int
    #: Pieces and uniform grasps per piece from which those with Q ≥ 0.05 are taken (Fig. 7, top).
    near05_pieces: int
    near05_grasps: int
    #: The same with Q ≥ 0.2 (Fig. 7, bottom).
    near20_pieces: int
    near20_grasps: int
    #: Grasps from which the search for bad neighbours starts.
    search_starts: int
    #: Rounds of that search.
    search_rounds: int
    #: Models from which grasps are carried in Fig. 9.
    fig9_sources: str
    #: Deformations of each kind in Fig. 8.
    moved: int
    #: How often Figs. 8 to 12 are run, each time with another seed.
    seeds: int
    #: The first of them, and the only one of Figs. 1 to 7.
    seed: int = 0
    friction: float = 1.0
    edges: int = 8

    @property
    def cone(self) -> Cone:
        """Friction and edges together."""
        return Cone(self.friction, self.edges)


#: Less than a minute on two cores, and the paper's own sizes.
SCALES = {
    "quick": Scale(
        "quick",
        survey_pieces=20,
        survey_grasps=100_000,
        near05_pieces=10,
        near05_grasps=10_000,
        near20_pieces=20,
        near20_grasps=100_000,
        search_starts=150,
        search_rounds=20,
        fig9_sources="aij",
        moved=10,
        seeds=2,
    ),
    "paper": Scale(
        "paper",
        survey_pieces=100,
        survey_grasps=1_000_000,
        near05_pieces=10,
        near05_grasps=1_000_000,
        near20_pieces=100,
        near20_grasps=1_000_000,
        search_starts=3000,
        search_rounds=200,
        fig9_sources="abcdefghijkl",
        moved=30,
        seeds=10,
    ),
}
