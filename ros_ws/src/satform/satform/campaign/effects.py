# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""What dispersions do, tried before a campaign is flown: values that cannot fly, and those without effect.

Cases of a loaded campaign are built here, which takes time: `satform check` does this, loading does not.
What loading checks is in `campaign_checks`.
"""

from collections.abc import Iterator, Sequence

from satform.campaign.cases import case_scenario, changed_scenario, values_at
from satform.campaign.dispersion import Dispersion
from satform.campaign.distributions import LARGEST_QUANTILE, LEAST_QUANTILE, ChoiceSpec
from satform.campaign.model import Campaign
from satform.campaign.paths import Target
from satform.campaign.plan_digest import plan_digest
from satform.campaign.sampling import Coordinate
from satform.common.name_list import listed
from satform.scenario import ScenarioError

_BEYOND = 0.05
"""Probability that any field of a dispersion lies beyond the values that are tried in any case."""

_FIRST_CASES = 3
"""Cases that are tried as they are."""

_MOST_VALUES = 20
"""Values of a grid or a choice that are tried."""

_MOST_FIELDS = 30
"""Fields of a dispersion that are tried one by one; of more, whether all together have an effect."""


def case_problems(campaign: Campaign) -> list[tuple[int | None, str]]:
    """Values of the campaign with which the scenario cannot fly.

    Each dispersion is tried alone at both ends of what the cases reach, all are tried together there, and the
    first cases as they are. The ends are quantiles that no draw passes with a probability of 95 %, whatever
    the number of cases and of fields of the dispersion.

    Args:
        campaign: loaded.

    Returns:
        Index of the dispersion, or None where several are together; and a sentence with the values and what
        is wrong with them.
    """
    alone: list[tuple[int | None, str]] = []
    own: list[Coordinate] = [None] * len(campaign.axes)
    for index, dispersion in enumerate(campaign.dispersions):
        ends = (_along(campaign, own, index, end) for end in _ends(campaign, dispersion))
        sentences = (sentence for end in ends if (sentence := _tried(campaign, end)))
        alone += [(index, sentence) for sentence in [next(sentences, "")] if sentence]
    # What does not fly alone does not fly together with others.
    return alone or list(dict.fromkeys((None, sentence) for sentence in _together(campaign) if sentence))


def _together(campaign: Campaign) -> Iterator[str]:
    """What is wrong when all dispersions are at their ends, and in the first cases."""
    for end in (0, -1):
        coordinates: list[Coordinate] = [None] * len(campaign.axes)
        for index, dispersion in enumerate(campaign.dispersions):
            coordinates = _along(campaign, coordinates, index, _ends(campaign, dispersion)[end])
        yield _tried(campaign, coordinates)
    for number in range(min(_FIRST_CASES, campaign.cases)):
        try:
            case_scenario(campaign, number)
        except ScenarioError as error:
            yield str(error.problems[0])


def without_effect(campaign: Campaign) -> list[tuple[int, str]]:
    """Dispersions that change nothing of what is flown.

    Args:
        campaign: loaded, with values that can fly.

    Returns:
        Index of the dispersion and a sentence; also where some fields of a wildcard have no effect, unless
        there are more than 30.
    """
    found: list[tuple[int, str]] = []
    for index, dispersion in enumerate(campaign.dispersions):
        targets = campaign.targets[index]
        if not _has_width(dispersion):
            found.append((index, f"{dispersion.path} has the same value in all cases"))
        elif _is_idle(campaign, index, targets):
            found.append((index, f"{dispersion.path} changes nothing of what is flown"))
        elif 1 < len(targets) <= _MOST_FIELDS:
            idle = [target.text for target in targets if _is_idle(campaign, index, [target])]
            if idle:
                verb = "changes" if len(idle) == 1 else "change"
                found.append((index, f"{listed(idle)} {verb} nothing of what is flown"))
    return found


def _is_idle(campaign: Campaign, index: int, targets: Sequence[Target]) -> bool:
    """Whether the flight is the same for all tried values of some fields of a dispersion."""
    digests: set[str] = set()
    for probe in _probes(campaign.dispersions[index]):
        values = values_at(campaign, _along(campaign, [None] * len(campaign.axes), index, probe))
        try:
            scenario = changed_scenario(
                campaign, {target.text: values[target.text] for target in targets}, "a case"
            )
        except ScenarioError:
            # Without the others it may not be valid; it is not without effect.
            return False
        digests.add(plan_digest(scenario))
        if len(digests) > 1:
            return False
    return True


def _along(
    campaign: Campaign, coordinates: Sequence[Coordinate], dispersion: int, probe: Coordinate
) -> list[Coordinate]:
    """Coordinates with those of one dispersion replaced."""
    return [
        probe if axis.dispersion == dispersion else own
        for axis, own in zip(campaign.axes, coordinates, strict=True)
    ]


def _ends(campaign: Campaign, dispersion: Dispersion) -> list[Coordinate]:
    if dispersion.grid is not None or isinstance(dispersion.distribution, ChoiceSpec):
        return list(_probes(dispersion))
    # That none of n draws passes an end has the probability (1 - q)^n, about 1 - q n; each axis is a draw.
    axes = sum(campaign.dispersions[axis.dispersion] is dispersion for axis in campaign.axes)
    quantile = max(LEAST_QUANTILE, 0.5 * _BEYOND / max(1, campaign.cases * axes))
    return [quantile, min(LARGEST_QUANTILE, 1.0 - quantile)]


def _probes(dispersion: Dispersion) -> Iterator[Coordinate]:
    """Coordinates at which a dispersion is tried."""
    if dispersion.grid is None:
        assert dispersion.distribution is not None  # noqa: S101 - the validator has seen to it
        yield from dispersion.distribution.probes()
        return
    count = len(dispersion.grid.points)
    tried = min(count, _MOST_VALUES)
    yield from dict.fromkeys(round(index * (count - 1) / max(1, tried - 1)) for index in range(tried))


def _has_width(dispersion: Dispersion) -> bool:
    if dispersion.grid is not None:
        return len(set(dispersion.grid.points)) > 1
    return dispersion.distribution is not None and dispersion.distribution.has_width()


def _tried(campaign: Campaign, coordinates: Sequence[Coordinate]) -> str:
    """What is wrong with the scenario at coordinates; empty when it can fly."""
    try:
        changed_scenario(campaign, values_at(campaign, coordinates), "a case")
    except ScenarioError as error:
        return str(error.problems[0])
    return ""
