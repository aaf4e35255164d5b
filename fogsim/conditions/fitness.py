"""Whether a run can evaluate a condition: what it needs, and the names in it."""

from collections.abc import Iterator
from dataclasses import dataclass

from fogsim.conditions.moment import EGO
from fogsim.conditions.signal import Need, Place
from fogsim.conditions.signals import NO_LEADER, SIGNALS
from fogsim.conditions.syntax import Comparison, Condition, Edge, Reference, Word, comparisons_of, signals_of
from fogsim.errors import shown, suggest

_LEADER = Reference("ego.leader")


@dataclass(frozen=True, slots=True)
class RunContent:
    """What conditions can refer to in a run: its needs, estimators, number of fog banks, and script entries."""

    needs: frozenset[Need]
    methods: tuple[str, ...] = ()
    banks: int = 0
    events: tuple[str, ...] = ()


def condition_mistakes(condition: Condition, content: RunContent) -> Iterator[str]:
    """Parts of a condition that a run cannot evaluate."""
    for reference in signals_of(condition):
        signal = SIGNALS[reference.signal]
        lacking = signal.needs - content.needs
        if EGO in vehicles_of(reference) and Need.EGO not in content.needs:
            lacking |= {Need.EGO}
        if lacking:
            yield f"{reference} needs {' and '.join(sorted(lacking))}, and this run has none"
            continue
        for place, argument in zip(signal.places, reference.arguments, strict=True):
            if place is Place.BANK and int(argument) >= content.banks:
                yield f"{reference}: there is no fog.banks.{argument}; the fog has {content.banks or 'no'} banks"
            known = {Place.METHOD: content.methods, Place.EVENT: content.events}.get(place)
            if known is not None and argument not in known:
                yield f"{reference}: unknown {place.value} {shown(argument)}; {suggest(argument, known)}"


def vehicles_of(reference: Reference) -> tuple[str, ...]:
    """Vehicles that a signal refers to."""
    return _names(reference, Place.VEHICLE)


def vehicles_in(condition: Condition) -> tuple[str, ...]:
    """Vehicles that a condition names: those of its signals, and those that are compared with ``ego.leader``."""
    named = [name for reference in signals_of(condition) for name in vehicles_of(reference)]
    for one in comparisons_of(condition):
        if one.left == _LEADER and isinstance(one, Comparison | Edge) and isinstance(one.right, Word):
            named += [one.right.word] * (one.right.word != NO_LEADER)
    return tuple(dict.fromkeys(named))


def lights_of(condition: Condition) -> tuple[str, ...]:
    """Traffic lights that a condition refers to."""
    return tuple(name for reference in signals_of(condition) for name in _names(reference, Place.SIGNAL))


def _names(reference: Reference, kind: Place) -> tuple[str, ...]:
    places = SIGNALS[reference.signal].places
    return tuple(name for place, name in zip(places, reference.arguments, strict=True) if place is kind)
