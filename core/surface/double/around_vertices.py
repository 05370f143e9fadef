"""Orders of faces around edges that go on from edge to edge.

The faces at a vertex cut a small sphere around it along a graph, its link: with a node for each edge of more than two
faces, and an arc for each fan of faces from one of these to the next. It parts the sphere into as many regions as
Euler's formula tells. Any orders of faces around its nodes draw it on some closed surface (B. Mohar and C. Thomassen,
Graphs on Surfaces, 2001, section 3.2), but on one with handles where there are fewer regions, and the double cover has
these, too. Angles tell such orders where faces are folded and cross each other.
"""

from dataclasses import dataclass
from functools import cached_property
from heapq import heappop, heappush
from itertools import count

import numpy as np

from ...parts import connected_parts
from ..mesh import Mesh

_TRIED = 300  # sets of edges with other orders, for each link

_Turns = dict[int, tuple[int, ...]]  # of edges, the places around them in order


def as_around_vertices(sheet: Mesh, order: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Corners in the order of :func:`order_around`, (3 f,), with faces around edges of more than two in an order that
    leaves as many regions around vertices as on a sphere, where such is found.

    Around most vertices it does. For each other one, faces that follow each other around edges change places, those
    first that are turned by the least about them, until it has more regions and no other vertex has fewer.

    angle : (m,) radians, by which the faces of the corners at edges of more than two, in order, are turned about these
    """
    line = np.repeat(sheet.edges.count, sheet.edges.count) > 2
    corner = order[line]
    links, angle = _links(sheet, order, line), angle.tolist()
    for link in np.flatnonzero(links.lacking).tolist():
        while links.lacking[link] and (turns := _mended(links, link, angle)):
            links.take(turns)
    order = order.copy()
    order[line] = corner[np.concatenate(list(links.turns.values()))]
    return order


@dataclass(frozen=True)
class _Links:
    """The links of vertices, as the orders of faces around edges draw them. The place of each of m faces in these has
    two darts, with its number at the lower end of the edge and m more at the higher one: the ends of the links' arcs.

    turns  : the places around each edge, in order     ends : the links of its lower and its higher end
    mate   : the dart at the other end of each one's arc; itself where this ends at a border
    wanted : how many regions each link has on a sphere     lacking : how many of these it has not
    """

    turns: _Turns
    ends: list[list[int]]
    mate: list[int]
    wanted: list[int]
    lacking: list[int]

    @cached_property
    def edges(self) -> list[list[int]]:
        """Those that each link has a node for."""
        found = [[] for _ in self.wanted]
        for edge, ends in enumerate(self.ends):
            for link in ends:
                found[link].append(edge)
        return found

    def lack(self, link: int, turns: _Turns) -> int:
        """How many regions a link lacks with the places around some edges in another order."""
        higher, after, lack = len(self.mate) // 2, {}, self.wanted[link]
        for edge in self.edges[link]:
            turn = turns.get(edge, self.turns[edge])
            pairs = zip(turn, turn[1:] + turn[:1], strict=True)
            after.update(pairs if link == self.ends[edge][0] else ((higher + b, higher + a) for a, b in pairs))
        while after:
            first, dart = after.popitem()
            while (dart := self.mate[dart]) != first:
                dart = after.pop(dart)
            lack -= 1
        return lack

    def take(self, turns: _Turns) -> None:
        """Have the places around some edges in another order."""
        self.turns.update(turns)
        for link in {link for edge in turns for link in self.ends[edge]}:
            self.lacking[link] = self.lack(link, {})


def _links(sheet, order, line):
    """The links of a sheet by the corners (3 f,) of all its faces in the order around edges, and which of these, (3 f,)
    bool, are at edges of more than two."""
    edge, mate = sheet.edges.number.reshape(-1)[order[line]], _mates(sheet, order, line)
    m, first = len(edge), np.flatnonzero(np.diff(edge, prepend=-1))
    place, dart, end = np.arange(m), np.arange(2 * m), np.append(first[1:], m)
    following, after = place + 1, np.empty(2 * m, np.intp)
    following[end - 1] = first
    after[place], after[m + following] = following, m + place
    link = connected_parts(np.append(dart, dart), np.append(after, mate), 2 * m)
    region = connected_parts(dart, mate[after], 2 * m)
    ends = link[np.stack([first, m + first], axis=1)]
    nodes, arcs, regions = (
        np.bincount(of, minlength=link.max() + 1)
        for of in (ends.reshape(-1), link[mate > dart], link[np.unique(region, return_index=True)[1]])
    )
    wanted = 2 - nodes + arcs  # Euler's formula
    turns = {k: tuple(range(*ends)) for k, ends in enumerate(zip(first.tolist(), end.tolist(), strict=True))}
    return _Links(turns, ends.tolist(), mate.tolist(), wanted.tolist(), (wanted - regions).tolist())


def _mates(sheet, order, line):
    """The darts at the other ends of their arcs, (2 m,), which go across edges of two faces around a vertex."""
    edges, vertex = sheet.edges, sheet.faces.reshape(-1)
    on_line = edges.ends_at(edges.count > 2) > 0
    beside = edges.corners_at_ends(order[np.repeat(edges.count, edges.count) == 2]).reshape(-1, 2)
    beside = beside[on_line[vertex[beside[:, 0]]]]
    arc = connected_parts(*beside.T, len(vertex))[edges.corners_at_ends(order[line]).reshape(-1)]
    mate, by_arc = np.arange(len(arc)), np.argsort(arc, kind="stable")
    one = np.flatnonzero(np.diff(arc[by_arc]) == 0)
    mate[by_arc[one]], mate[by_arc[one + 1]] = by_arc[one + 1], by_arc[one]
    return mate


def _mended(links, start, angle):
    """Other turns around a few edges, with which one link, where to start, lacks less and no other one lacks more; None
    if such are not found. The best are looked for first (E. W. Dijkstra, Numerische Mathematik 1, 1959), by the sum of
    the angles between faces that change places; each change leaves no more lacking where that is mended next."""
    number, heap, tried = count(), [(0.0, 0, {}, {start: links.lacking[start]})], set()
    while heap and len(tried) < _TRIED:
        sum_, _, turns, lacks = heappop(heap)
        key = frozenset(turns.items())
        if key in tried:
            continue
        tried.add(key)
        worse = next((link for link, lack in lacks.items() if lack > links.lacking[link] - (link == start)), None)
        if worse is None:
            return turns
        for edge in links.edges[worse]:
            for by, turn in _swapped(turns.get(edge, links.turns[edge]), angle):
                other = turns | {edge: turn}
                if (lack := links.lack(worse, other)) <= lacks[worse]:
                    (end,) = set(links.ends[edge]) - {worse}
                    both = {worse: lack, end: links.lack(end, other)}
                    heappush(heap, (sum_ + by, next(number), other, lacks | both))
    return None


def _swapped(turn, angle):
    """Turns where two places of one that follow each other are changed for each other, from the lowest place on, and
    the angle between them."""
    for k in range(len(turn)):
        by = abs((angle[turn[k]] - angle[turn[k - 1]] + np.pi) % (2 * np.pi) - np.pi)
        other = list(turn)
        other[k - 1], other[k] = other[k], other[k - 1]
        lowest = other.index(min(other))
        yield by, tuple(other[lowest:] + other[:lowest])
