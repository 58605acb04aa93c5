# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""TLE, OMM and OEM against published SGP4 cases, each other and closed forms; bad files."""

from datetime import UTC, datetime, timedelta

import brahe
import numpy as np
import pytest

from orbit_texts import OMM, TLE, kepler, oem
from satform.files.named_file import NamedFile
from satform.orbits.orbit_files import from_lines, from_oem, from_omm, from_tle
from satform.orbits.time_scales import brahe_epoch

EPOCH = datetime(2000, 6, 27, 18, 50, 19, 733568, tzinfo=UTC)
START = datetime(2024, 1, 1, tzinfo=UTC)
MIDDLE = START + timedelta(minutes=9, seconds=30)

PUBLISHED = (
    (0.0, (7022.46529266, -1400.08296755, 0.03995155, 1.893841015, 6.405893759, 4.534807250)),
    (360.0, (-7154.03120202, -3783.17682504, -3536.19412294, 4.741887409, -4.151817765, -2.093935425)),
    (4320.0, (-9060.47373569, 4658.70952502, 813.68673153, -2.232832783, -4.110453490, -3.157345433)),
)
"""Minutes after the epoch; TEME, km and km/s (Vallado et al. 2006, AIAA 2006-6753)."""


def named(text, name="file.txt"):
    return NamedFile(name, text if isinstance(text, bytes) else text.encode())


def whole(state):
    return np.concatenate((state.position, state.velocity))


@pytest.fixture(autouse=True)
def no_earth_orientation():
    """UT1 = UTC for what brahe itself is asked for here, whatever another test has set."""
    brahe.set_global_eop_provider_from_static_provider(brahe.StaticEOPProvider.from_zero())


@pytest.mark.parametrize(("minutes", "published"), PUBLISHED)
def test_sgp4_gives_the_published_states(minutes, published):
    # brahe computes with the constants of WGS 84, the paper with those of WGS 72.
    date = EPOCH + timedelta(minutes=minutes)
    teme = brahe.state_gcrf_to_teme(brahe_epoch(date), whole(from_lines(TLE, "lines").state_at(date))) / 1e3
    assert np.linalg.norm(teme[:3] - published[:3]) < 0.025
    assert np.linalg.norm(teme[3:] - published[3:]) < 2.5e-5


def test_teme_turns_into_the_published_inertial_state():
    # The paper's J2000 is of the theory of 1976 and 1980 without the corrections of the celestial pole.
    date = EPOCH + timedelta(days=3)
    state = whole(from_lines(TLE, "lines").state_at(date)) / 1e3
    off = brahe.state_gcrf_to_teme(brahe_epoch(date), state)[:3] - PUBLISHED[2][1][:3]
    inertial = brahe.state_gcrf_to_eme2000(state)[:3] - (-9059.9413786, 4659.6972000, 813.9588875)
    assert np.linalg.norm(inertial - off) < 3e-3


def test_the_epoch_is_that_of_the_elements():
    assert from_lines(("NAME", *TLE), "lines").epoch == EPOCH == from_omm(named(OMM)).epoch


def test_the_same_elements_give_the_same_state_from_every_file():
    date = EPOCH + timedelta(hours=30)
    expected = whole(from_lines(TLE, "lines").state_at(date))
    text = "\r\n".join(TLE) + "\r\n"
    assert np.array_equal(whole(from_tle(named(text)).state_at(date)), expected)
    assert np.allclose(whole(from_omm(named(OMM)).state_at(date)), expected, rtol=1e-12, atol=1e-3)


@pytest.mark.parametrize("interpolation", ["LAGRANGE", "HERMITE"])
@pytest.mark.parametrize("frame", ["GCRF", "EME2000"])
def test_an_ephemeris_is_that_of_two_body_motion(frame, interpolation):
    found = whole(from_oem(named(oem(frame, interpolation=interpolation))).state_at(MIDDLE))
    expected = kepler(570.0)
    assert np.allclose(found[:3], expected[:3], rtol=0.0, atol=1e-5)
    assert np.allclose(found[3:], expected[3:], rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("degree", "position", "velocity"), [(3, 0.36, 0.018), (5, 2e-4, 1e-5), (7, 1e-6, 1e-8)]
)
def test_hermite_interpolation_is_of_the_degree_of_the_file(degree, position, velocity):
    # A cubic is off by the fourth derivative of position times the fourth power of the minute over 384.
    text = oem(interpolation="HERMITE").replace("DEGREE = 9", f"DEGREE = {degree}")
    motion = from_oem(named(text))
    for second in (15, 30, 525, 570, 1110):
        off = whole(motion.state_at(START + timedelta(seconds=second))) - kepler(float(second))
        assert np.linalg.norm(off[:3]) < position
        assert np.linalg.norm(off[3:]) < velocity


def test_a_cubic_hermite_polynomial_takes_two_states():
    lines = oem(interpolation="HERMITE", count=2).replace("DEGREE = 9", "DEGREE = 3")
    more = oem(interpolation="HERMITE", count=20).replace("DEGREE = 9", "DEGREE = 3")
    date = START + timedelta(seconds=20)
    pair, many = (whole(from_oem(named(text)).state_at(date)) for text in (lines, more))
    assert np.allclose(pair, many, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("interpolation", ["LAGRANGE", "HERMITE"])
def test_an_ephemeris_keeps_its_states(interpolation):
    found = whole(from_oem(named(oem(interpolation=interpolation))).state_at(START + timedelta(minutes=4)))
    assert np.allclose(found, kepler(240.0), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(("scale", "seconds"), [("TAI", 37.0), ("GPS", 18.0), ("TT", 69.184)])
def test_an_ephemeris_is_in_its_time_scale(scale, seconds):
    found = from_oem(named(oem(scale=scale, hour=1)))
    begin = START + timedelta(hours=1) - timedelta(seconds=seconds)
    assert found.epoch == begin
    state = whole(found.state_at(begin + timedelta(minutes=9, seconds=30)))
    assert np.allclose(state[:3], kepler(570.0)[:3], rtol=0.0, atol=5e-3)


def test_an_ephemeris_of_teme_is_turned():
    epoch = brahe.Epoch.from_string("2024-01-01T00:04:00Z")
    found = whole(from_oem(named(oem("TEME"))).state_at(START + timedelta(minutes=4)))
    assert np.allclose(found, brahe.state_teme_to_gcrf(epoch, kepler(240.0)), rtol=0.0, atol=1e-3)


@pytest.mark.parametrize("minutes", [-1.0, 19.5])
def test_beyond_an_ephemeris_there_is_no_state(minutes):
    with pytest.raises(
        ValueError, match=r"has states from 2024-01-01T00:00:00 UTC to 2024-01-01T00:19:00 UTC"
    ):
        from_oem(named(oem())).state_at(START + timedelta(minutes=minutes))


def test_old_elements_are_not_propagated():
    with pytest.raises(ValueError, match=r"are of 2000-06-27T18:50:19 UTC, 31\.0 days before time zero"):
        from_lines(TLE, "lines").state_at(EPOCH + timedelta(days=31))


def test_elements_of_what_has_decayed_give_no_state():
    # SGP4 has the satellite of the verification set below the ground 20 days later.
    first = "1 25544U 98067A   08264.51782528 -.00002182  00000-0  99999+0 0  2923"
    line = f"{first[:-1]}{brahe.calculate_tle_line_checksum(first)}"
    second = "2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537"
    motion = from_lines((line, second), "lines")
    with pytest.raises(ValueError, match="gives no"):
        motion.state_at(motion.epoch + timedelta(days=20))


FIRST, SECOND = TLE
BAD_LINES = (
    ((FIRST,), "has 1 lines"),
    ((FIRST, SECOND, FIRST, SECOND), "has 4 lines"),
    ((FIRST[:50], SECOND), "line 1 of two-line elements has 69 characters"),
    ((SECOND, FIRST), 'begins with "1 "'),
    ((FIRST, SECOND[:-1] + "0"), "line 2 ends with the checksum 0, and its sum is 7"),
    ((FIRST, "2 00006" + SECOND[7:-1] + "8"), "line 1 is of object 00005, line 2 of 00006"),
    (("1 00005U 58002Bé" + FIRST[16:], SECOND), "line 1 of two-line elements"),
)


@pytest.mark.parametrize(("lines", "sentence"), BAD_LINES)
def test_bad_lines_are_named(lines, sentence):
    with pytest.raises(ValueError, match="lines") as caught:
        from_lines(lines, "lines")
    assert sentence in str(caught.value)


def test_numbers_that_are_none_are_named():
    line = SECOND[:8] + " xx.2682" + SECOND[16:-1]
    line += str(brahe.calculate_tle_line_checksum(line + "0"))
    with pytest.raises(ValueError, match="has no elements that SGP4 takes"):
        from_lines((FIRST, line), "lines")


BAD_OMM = (
    ("", "is not an OMM file that can be read"),
    ("hello", "is not an OMM file that can be read"),
    (b"\xff\xfe", "is not UTF-8 text"),
    (OMM[:300], "is not an OMM file that can be read"),
    (OMM.replace("= UTC", "= TAI"), "found TIME_SYSTEM TAI; it should be UTC"),
    (OMM.replace("= TEME", "= GCRF"), "found REF_FRAME GCRF; it should be TEME"),
    (OMM.replace("= EARTH", "= MARS"), "found CENTER_NAME MARS; it should be EARTH"),
    (OMM.replace("THEORY = SGP4", "THEORY = DSST"), "found MEAN_ELEMENT_THEORY DSST"),
    (OMM.replace("0.1859667", "1.5"), "found ECCENTRICITY 1.5"),
    (OMM.replace("0.1859667", "nan"), "found ECCENTRICITY nan"),
    (OMM.replace("10.82419157", "0.0"), "found MEAN_MOTION 0.0"),
    (OMM.replace("2000-06-27", "2000-13-27"), "has the date 2000-13-27T18:50:19, which does not exist"),
    (OMM.replace("2000-06-27", "2026-366"), "has the date 2026-366T18:50:19, which does not exist"),
    (OMM.replace("2000-06-27", "0000-06-27"), "has the date 0000-06-27T18:50:19, which does not exist"),
    (OMM.replace("2000-06-27", "2000-999"), "has the date 2000-999T18:50:19, which does not exist"),
)


@pytest.mark.parametrize(("text", "sentence"), BAD_OMM)
def test_bad_omm_files_are_named(text, sentence):
    with pytest.raises(ValueError, match=r"file\.txt") as caught:
        from_omm(named(text))
    assert sentence in str(caught.value)


GOOD = oem()
BAD_OEM = (
    ("", "is not an OEM file that can be read"),
    (OMM, "is not an OEM file that can be read"),
    (GOOD[:600], "is not an OEM file that can be read"),
    (GOOD.replace("= GCRF", "= ITRF2000"), "found REF_FRAME ITRF2000; it should be EME2000 or GCRF"),
    (GOOD.replace("= UTC", "= UT1"), "found TIME_SYSTEM UT1"),
    (GOOD.replace("= EARTH", "= MARS"), "found CENTER_NAME MARS; it should be EARTH"),
    (oem(count=1), "has 1 states"),
    (GOOD.replace("2024-01-01T00:05", "2024-02-31T00:05"), "has the date 2024-02-31T00:05:00, which does"),
    (GOOD.replace("2024-01-01T00:05", "2024-01-01T25:05"), "has the date 2024-01-01T25:05:00, which does"),
    (GOOD.replace("2024-01-01T00:05", "0000-01-01T00:05"), "has the date 0000-01-01T00:05:00, which does"),
    (GOOD.replace("T00:05:00.000", "T00:15:00.000"), "follow each other in time"),
    (GOOD + GOOD[GOOD.index("META_START") :], "has 2 segments"),
)


def test_a_leap_day_by_its_number_is_a_date():
    assert from_omm(named(OMM.replace("2000-06-27", "2000-366"))).epoch.day == 31


@pytest.mark.parametrize(("text", "sentence"), BAD_OEM)
def test_bad_oem_files_are_named(text, sentence):
    with pytest.raises(ValueError, match=r"file\.txt") as caught:
        from_oem(named(text))
    assert sentence in str(caught.value)
