"""Where several sheets meet, cross, or run close to each other.

A crease or a tight bend looks like two sheets to a few samples, too. Two samples lie on different sheets where neither
is on the other's tangent plane, where no sample between them lies on one sheet with both, and where their
sheets either run side by side or one goes on past the other's plane; or where there is a third sheet between whose two
sides they lie, while each of theirs parts the others, too; where many pairs of a neighbourhood do.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ...field.local_surface import LocalSurface
from ...field.projection import MEMBER, TRUSTED, membership
from ...linalg import cross, dots, links_in_common, row_dots
from ...lookup import mask_of, numbered
from ...parallel import even_chunks, in_order, over_rows, work_through
from ...parts import connected_parts
from ...progress import Progress
from .sheets import SIDE_BY_SIDE

NEIGHBOURS = 32
_LINKED = 0.8  # least confidence of samples that link others
_ASKEW = float(np.sqrt(1 - SIDE_BY_SIDE**2))  # least sine of the angle between sheets that do not run side by side
_WIDER, _CLOSE = 120, 60  # samples among which a sheet is followed, and close by where it meets another squarely
_STRAIGHT, _FAR = 0.5, 4.0  # least membership of those it is followed over; local spacings, up to where
_PAST = 1.0  # local spacings along itself that a sheet goes on, on either side of the other
_PARTED = 0.3  # local spacings, off the plane of one of three sheets that end at a line, samples of the others
_THIRD = 4  # samples of the third, at least
_LEVEL = 0.3  # volume that the normals of such sheets span, at most
_CHUNK, _FOLLOWED = 8192, 512  # samples, and those whose sheets are followed, at a time
_SHARE, _LEAST = 0.3, 12  # of the pairs of unlike samples in a neighbourhood, on two sheets where these meet
_WEAK, _NEXT = 0.15, 8  # that share where samples connect to such ones, by so many of the nearest each
FEW = 0.005  # of all samples, at meetings, beside others, or that show no line: as few may be chance
_THROUGH = 0.125  # of the samples at meetings: as many on sheets that pass through one another are no chance
_BESIDE = 0.05  # of the samples at meetings: more beside another sheet tear single layers
_MUCH = 1 / 3  # of them: of thick shapes mostly .31 and less, where walls or slits are thin .36 and more
_LINE, _AROUND, _DENSE = 24, 12, 0.33  # samples that show a line, at least; around each; share of all around, at least
_PASSING = 24  # samples around one, with such a sample among which it is close to the line


@dataclass(frozen=True)
class Meetings:
    """Samples in whose neighbourhood there are several sheets.

    at      : (n,) bool, all of them
    through : (n,) bool, samples whose sheet passes through another one; nearly all are marked in `at`, too
    beside  : (n,) bool, those at meetings with another sheet that runs side by side with theirs
    passing : (n,) bool, all samples close to lines along which sheets pass through one another
    """

    at: np.ndarray
    through: np.ndarray
    beside: np.ndarray
    passing: np.ndarray

    @property
    def few(self) -> bool:
        """Whether so few of all samples are at meetings that these may be chance."""
        return bool(self.at.mean() <= FEW)

    @property
    def pass_through(self) -> bool:
        """Whether sheets pass through one another, and do not only look like that by chance."""
        many = self.passing.any() or self.through.mean() > FEW
        return bool(many and not self.few and self._share(self.through) >= _THROUGH)

    @property
    def side_by_side(self) -> bool:
        """Whether sheets run so close beside each other that single layers are torn there."""
        return not self.few and bool(self._share(self.beside) > _BESIDE)

    @property
    def much_side_by_side(self) -> bool:
        """Whether a third of the meetings and more are of sheets that run so close, as where walls or slits are thin;
        creases and tight bends of thick shapes may look like some."""
        return self.side_by_side and bool(self._share(self.beside) > _MUCH)

    def adds_to(self, others: "Meetings") -> bool:
        """Whether more samples are at these meetings than at others, and not so few that they may be chance."""
        return bool((self.at & ~others.at).mean() > FEW)

    def with_beside(self, others: np.ndarray) -> "Meetings":
        """These and samples (n,) bool known to be beside another sheet; these alone where so few are new that they may
        be chance."""
        if (others & ~self.beside).mean() <= FEW:
            return self
        return replace(self, at=self.at | others, beside=self.beside | others)

    def _share(self, some):
        return some.sum() / max(self.at.sum(), 1)


def find_meetings(surface: LocalSurface, progress=None, by_room: bool = False) -> Meetings:
    """Where sheets meet, cross or run close, from the samples alone. Sheets closer than the samples on each are told
    apart `by_room` of each sample beside others, too, if asked for; creases may then look like such sheets."""
    progress, n = Progress.of(progress), len(surface.points)
    nearest, member = _members(surface, min(NEIGHBOURS + 1, n), by_room, progress)
    alike = member > MEMBER
    trusted = surface.confidence >= TRUSTED
    unlike = ~alike & trusted[nearest] & trusted[:, None]
    i, at = np.nonzero(unlike)
    j = nearest[i, at]
    if not len(i):
        return Meetings(*np.zeros((4, n), bool))
    apart = ~_linked(i, j, nearest, alike, surface.confidence >= _LINKED)
    cosine = np.abs(row_dots(surface.normals[i], surface.normals[j]))
    askew = np.flatnonzero(apart & (cosine <= SIDE_BY_SIDE))
    past, close = _goes_past(i[askew], j[askew], surface)
    apart[askew] = past > 0
    rest = np.flatnonzero(~apart & (cosine <= SIDE_BY_SIDE))
    apart[rest] = _in_threes(i[rest], j[rest], nearest, unlike, surface)
    pairs, found = (np.bincount(i[chosen], minlength=n)[nearest].sum(axis=1) for chosen in (slice(None), apart))
    at = _grown(*((found >= _LEAST) & (found >= share * pairs) for share in (_SHARE, _WEAK)), nearest)
    pair = np.stack([i, j])
    through = mask_of(pair[:, askew[close == 2]], n)
    beside = at & mask_of(pair[:, apart & (cosine > SIDE_BY_SIDE)], n)
    return Meetings(at, through, beside, _of_lines(through, nearest)[nearest[:, :_PASSING]].any(axis=1))


def _grown(sure, weak, nearest):
    """The samples marked as `weak` (n,) bool that others connect to `sure` ones, as weak edges of an image (Canny, IEEE
    PAMI 8(6), 1986), (n,) bool; `nearest` (n,k) tells which lie next to each other."""
    part = _parts(weak, nearest[:, : 1 + _NEXT])
    return weak & np.isin(part, part[sure])


def _of_lines(through, nearest):
    """Which of the samples of sheets that pass `through` one another, (n,) bool, show a line: where many are connected,
    and they are many of those around. At tight bends and thin parts some samples look like that by chance."""
    n, of, part = len(nearest), np.flatnonzero(through), _parts(through, nearest)
    around = np.unique(part[of, None] * n + nearest[of, : 1 + _AROUND]) // n
    count = np.bincount(part[of], minlength=n)
    return through & ((count >= _LINE) & (count >= _DENSE * np.bincount(around, minlength=n)))[part]


def _parts(marked, nearest):
    """Number of the connected part of each sample, (n,) int64, where those marked, (n,) bool, are connected to the
    others among their `nearest` (n,k)."""
    n, of = len(nearest), np.flatnonzero(marked)
    row, column = np.nonzero(marked[nearest[of]])
    return connected_parts(of[row], nearest[of[row], column], n).astype(np.int64)


def _linked(i, j, nearest, alike, sure):
    """Whether samples i and j, (m,) each, have a sure sample between them that is an alike neighbour of both."""
    n, kept = len(nearest), alike & sure[:, None] & sure[nearest]
    first = np.append(0, np.cumsum(kept.sum(axis=1)))
    links = csr_matrix((np.ones(first[-1], np.int8), nearest[kept], first), shape=(n, n))
    links, found = links + links.T, np.empty(len(i), bool)

    def look(part):
        found[part] = links_in_common(links, i[part], j[part]) > 0

    over_rows(look, len(i), _CHUNK)
    return found


def _goes_past(i, j, surface):
    """Of how many of two samples, 0 to 2, the sheet goes on past the other's tangent plane, well to both sides of it,
    (m,); and of how many it does so close by, (m,). None where they run side by side. The smaller their angle, the
    farther from the line are the nearest samples that are unlike, so more count as close."""
    n = len(surface.points)
    pair, number = numbered(np.minimum(i, j) * n + np.maximum(i, j))
    ends, past = np.stack(np.divmod(pair, n)), np.zeros((2, len(pair)), np.int8)
    every, row = numbered(ends)
    followed = _followed(every, surface)
    column, points, normals = np.arange(followed.shape[1]), surface.columns.points, surface.normals.T

    def look(part):
        for one, other in ((0, 1), (1, 0)):
            own, on = ends[one, part], ends[other, part]
            near = followed[row[one, part]]
            away = [x.take(near) - x.take(on)[:, None] for x in points]
            height = dots(away, [axis.take(on)[:, None] for axis in normals])
            sine = np.sqrt(1 - np.minimum(1, row_dots(surface.normals[own], surface.normals[on]) ** 2))
            limit = np.where(sine < _ASKEW, np.inf, _PAST * surface.spacing[own] * sine)
            close = column < _CLOSE / np.maximum(sine, _ASKEW)[:, None]
            for which, known in enumerate((near >= 0, (near >= 0) & close)):
                above, below = (np.where(known, side, 0).max(axis=1) for side in (height, -height))
                past[which, part] += np.minimum(above, below) > limit

    over_rows(look, len(pair), _CHUNK)
    return past[:, number]


def _in_threes(i, j, nearest, unlike, surface):
    """Whether samples i and j lie on two of three sheets that end at one line, (m,): the plane of each parts the other
    two, as at no crease and no corner of three faces. Of the third some samples are among those nearest to i."""
    found, columns = np.empty(len(i), bool), (surface.columns.points, surface.normals.T)

    def look(part):
        pair, column = np.nonzero(unlike[i[part]])
        own, other = i[part][pair], j[part][pair]
        samples = own, other, nearest[own, column]
        (p, q, r), (n, o, m) = ([np.stack([x.take(some) for x in of]) for some in samples] for of in columns)
        sides = (
            dots(q - p, n) * dots(r - p, n),
            dots(p - q, o) * dots(r - q, o),
            dots(p - r, m) * dots(q - r, m),
        )
        limit = (_PARTED * surface.spacing[own]) ** 2
        third = (np.max(sides, axis=0) < -limit) & (np.abs(dots(cross(n, o), m)) < _LEVEL)
        found[part] = np.bincount(pair, third, len(found[part])) >= _THIRD

    over_rows(look, len(i), _CHUNK)
    return found


def _followed(own, surface):
    """The samples that the sheets of samples `own` (m,) are followed over, nearest first, (m,k) int32; -1 for others
    around."""
    followed = np.empty((len(own), min(_WIDER, len(surface.points))), np.int32)

    def look(part):
        away, near, member = _around(own[part], followed.shape[1], surface)
        sure = (member > _STRAIGHT) & (surface.confidence[near] >= _LINKED)
        followed[part] = np.where(sure & (away <= _FAR * surface.spacing[own[part], None]), near, -1)

    work_through(look, Progress().chunks(len(own), _FOLLOWED))
    return followed


def _members(surface, k, by_room, progress):
    """The k samples nearest to each, and how surely each of them lies on one sheet with it, (n,k)."""
    n = len(surface.points)
    nearest, member = np.empty((n, k), np.int64), np.empty((n, k), np.float32)
    for part, found in in_order(lambda part: _around(part, k, surface, by_room), even_chunks(n, _CHUNK, progress)):
        nearest[part], member[part] = found[1:]
    return nearest, member


def _around(own, k, surface, by_room=False):
    """Distances to the k samples nearest to some, which they are, and how surely each lies on one sheet, (m,k)."""
    away, near = surface.tree.query(surface.points[own], k=k)
    points, normals = surface.columns.points, surface.normals.T
    between = np.stack([x.take(near) - x[own, None] for x in points])
    own_normals, theirs = normals[:, own, None], np.stack([column.take(near) for column in normals])
    room = surface.room[own, None] if by_room else np.inf
    return away, near, membership(between, dots(between, own_normals), dots(between, theirs), room)
