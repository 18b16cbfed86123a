"""The split of volumes into training, validation and test: by volume, never by annotation, and repeatable."""

import hashlib
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from annotations.errors import UserError

SPLITS = ("train", "validation", "test")


@dataclass(frozen=True)
class SplitRule:
    """Which share of the volumes goes where.

    Attributes
    ----------
    shares : (float, float, float)
        Of training, validation and test; they add up to 1.
    seed : int
        Which of the possible splits.
    """

    shares: tuple[float, float, float] = (0.8, 0.2, 0.0)
    seed: int = 0


def split_rule(shares: Sequence[float], seed: int) -> SplitRule:
    """Return the rule for two or three shares; UserError where they are not shares of a whole."""
    if not 2 <= len(shares) <= len(SPLITS):
        raise UserError(
            f"a split has two or three shares, not {len(shares)}",
            remedy="Give those of training, validation and, if wanted, test, such as 0.7 0.2 0.1",
        )
    if not all(math.isfinite(share) and share >= 0 for share in shares) or abs(math.fsum(shares) - 1) > 1e-6:
        raise UserError(
            f"the shares {' '.join(f'{share:g}' for share in shares)} do not add up to 1",
            remedy="Give shares of a whole, such as 0.8 0.2",
        )
    train, validation, test = (*shares, 0.0)[: len(SPLITS)]
    return SplitRule((train, validation, test), seed)


def split_of(volumes: Sequence[tuple[str, str]], rule: SplitRule) -> tuple[str, ...]:
    """Return the split of each row of a training file.

    Rows of one volume stay together, and so do volumes of one fingerprint, which hold the same data. These
    groups come in an order that looks random and depends on the seed and the fingerprints alone, so that
    neither the order of the rows nor the names of the volumes play a part. Along this order each group goes
    where its middle falls: the shares are met to within the size of the largest group. A split that has a
    share and would stay empty takes a group from the one with most groups, as long as that has two.

    Parameters
    ----------
    volumes : sequence of (str, str)
        The volume's id and fingerprint, for each row.
    rule : SplitRule

    Returns
    -------
    tuple of str
        ``train``, ``validation`` or ``test`` for each row.
    """
    groups = _groups(volumes)
    groups.sort(key=lambda group: min(_drawn(rule.seed, fingerprint) for _, fingerprint in group))
    sizes = [len({volume_id for volume_id, _ in group}) for group in groups]
    split: dict[tuple[str, str], str] = {}
    for group, name in zip(groups, _dealt(sizes, rule.shares), strict=True):
        split.update(dict.fromkeys(group, name))
    return tuple(split[volume] for volume in volumes)


def _dealt(sizes: Sequence[int], shares: Sequence[float]) -> list[str]:
    """Return the split of each group, of which the order and the sizes are given."""
    ends = list(itertools.accumulate(shares))
    wanted = [index for index, share in enumerate(shares) if share]
    counts = [0] * len(SPLITS)
    before = 0
    for size in sizes:
        middle = (before + size / 2) / sum(sizes)
        # The ends are sums of rounded numbers: what lies beyond them all belongs to the last split in use.
        counts[next((index for index, end in enumerate(ends) if middle < end), wanted[-1])] += 1
        before += size
    for index in wanted:
        giver = counts.index(max(counts))
        if not counts[index] and counts[giver] > 1:
            counts[giver] -= 1
            counts[index] += 1
    return [name for name, count in zip(SPLITS, counts, strict=True) for _ in range(count)]


def _groups(volumes: Sequence[tuple[str, str]]) -> list[set[tuple[str, str]]]:
    """Return the rows' volumes in groups that share no id and no fingerprint with each other."""
    group_of: dict[tuple[str, str], set[tuple[str, str]]] = {}
    for volume_id, fingerprint in volumes:
        keys = (("id", volume_id), ("fingerprint", fingerprint))
        merged = {(volume_id, fingerprint)}.union(*(group_of.get(key, set()) for key in keys))
        for member_id, member_fingerprint in merged:
            group_of["id", member_id] = group_of["fingerprint", member_fingerprint] = merged
    return list({id(group): group for group in group_of.values()}.values())


def _drawn(seed: int, fingerprint: str) -> str:
    """Return text whose order looks random; no generator's version can change it."""
    return hashlib.sha256(f"{seed}\n{fingerprint}".encode("utf-8", "surrogatepass")).hexdigest()
