"""Who agrees with whom, who is right, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from nusselt.experiments.results.rows import percent
from nusselt.experiments.verdict.decision import Word
from nusselt.renderer.words import count

from .compare import Difference

Pairs = Mapping[tuple[str, str], Difference]
"""By both names, in either order."""


@dataclass(frozen=True)
class Cluster:
    """Renderers of which no two differ.

    Parameters
    ----------
    names : tuple of str
        The most precise first.
    right : bool or None
        Whether they are what the exact image is: none differs from it, and one at least agrees; None: not known.
    """

    names: tuple[str, ...]
    right: bool | None


@dataclass(frozen=True)
class Findings:
    """Of one scene.

    Parameters
    ----------
    clusters : tuple of Cluster
        The right ones first, the largest first.
    between : tuple of str
        Who fits several of them: too noisy to tell.
    words : dict
        What each is called against the exact image.
    said : tuple of str
        Sentences.
    """

    clusters: tuple[Cluster, ...]
    between: tuple[str, ...]
    words: dict[str, Word]
    said: tuple[str, ...]


def find_clusters(names: Sequence[str], pairs: Pairs, exact: Mapping[str, Difference]) -> Findings:
    """Put renderers together that do not differ, the most precise first, and say who is right.

    Parameters
    ----------
    names : sequence of str
    pairs : mapping
        Differences between any two.
    exact : mapping
        Of each from the exact image.
    """
    precise = sorted(names, key=lambda name: exact[name].finds)
    groups: list[list[str]] = []
    fits: dict[str, list[int]] = {}
    for name in precise:
        fits[name] = [
            k for k, group in enumerate(groups) if all(pairs[name, other].word != "differs" for other in group)
        ]
        if not fits[name]:
            groups.append([name])
        elif len(fits[name]) == 1:
            groups[fits[name][0]].append(name)
    between = tuple(name for name in precise if len(fits[name]) > 1)
    clusters = [Cluster(tuple(group), _right([exact[name] for name in group])) for group in groups]
    clusters.sort(key=lambda cluster: (not cluster.right, -len(cluster.names)))
    words = {name: exact[name].word for name in names}
    return Findings(tuple(clusters), between, words, tuple(_sentences(clusters, between, pairs, exact)))


def _right(differences: Sequence[Difference]) -> bool | None:
    words = {one.word for one in differences}
    return False if "differs" in words else True if "agrees" in words else None


def _sentences(
    clusters: Sequence[Cluster], between: Sequence[str], pairs: Pairs, exact: Mapping[str, Difference]
) -> list[str]:
    said = []
    right = [name for cluster in clusters if cluster.right for name in cluster.names]
    for cluster in clusters:
        if cluster.right is False:
            said.append(_wrong(cluster.names, right, pairs, exact))
        else:
            said += _not_wrong(cluster.names, exact)
    if between:
        said.append(f"{_and(between)}: too noisy to say with whom {'they agree' if len(between) > 1 else 'it agrees'}")
    return said


def _not_wrong(names: Sequence[str], exact: Mapping[str, Difference]) -> list[str]:
    """Of a cluster that nothing speaks against: who agrees, and who is too noisy for that."""
    agree = [name for name in names if exact[name].word == "agrees"]
    noisy = [name for name in names if exact[name].word != "agrees"]
    said = []
    if agree:
        finest = percent(min(exact[name].finds for name in agree))
        said.append(
            f"{_and(agree)} {_s('agrees', agree)} with the exact image, within noise and what the method allows; the "
            f"smallest bias that would have been found: {finest}"
        )
    if noisy:
        would = ", ".join(f"{name} {percent(exact[name].finds)}" for name in noisy)
        said.append(f"{_and(noisy)}: nothing speaks against {_them(noisy)}; what would have been found: {would}")
    return said


def _wrong(names: Sequence[str], right: Sequence[str], pairs: Pairs, exact: Mapping[str, Difference]) -> str:
    """Of a cluster that the exact image speaks against."""
    off = [f"{name} {exact[name].reason}" for name in names if exact[name].word == "differs"]
    told = "; ".join(off)
    if len(names) > 1:
        shared = f"{_and(names)} agree with each other and not with the exact image: {told}"
        if right:
            return f"{shared}. {_and(right)} {_s('supports', right)} the exact image: {_and(names)} share a mistake"
        return f"{shared}. No renderer supports the exact image here: the mistake is theirs in common, or ours"
    if right:
        against = [other for other in right if pairs[names[0], other].word == "differs"]
        rest = f", and from {_and(against)}" if against else ""
        return f"{names[0]} is the odd one out: it differs from the exact image{rest}: {told}"
    return f"{names[0]} differs from the exact image, which no other renderer supports here: {told}"


def _and(names: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _s(verb: str, names: Sequence[str]) -> str:
    return verb if len(names) == 1 else verb.removesuffix("s")


def _them(names: Sequence[str]) -> str:
    return "it" if len(names) == 1 else "them"


def headline(findings: Sequence[Findings]) -> str:
    """Of all scenes together, in a sentence."""
    words: dict[str, set[str]] = {}
    for one in findings:
        for name, word in one.words.items():
            words.setdefault(name, set()).add(word)
    wrong = sorted(name for name, said in words.items() if "differs" in said)
    right = [name for name, said in words.items() if said == {"agrees"}]
    if wrong:
        return f"{len(wrong)} of {count(len(words), 'renderer')} not what the exact image is: {_and(wrong)}"
    noisy = sorted(set(words) - set(right))
    if not noisy:
        return f"{_and(right)} {_s('agrees', right)} with the exact image"
    agree = f"; {_and(right)} {_s('agrees', right)} with it in every scene" if right else ""
    return f"Nobody differs from the exact image{agree}; {_and(noisy)}: too much noise to say so"
