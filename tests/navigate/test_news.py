"""What is told of a session that moves: each target once, each refusal and each limit once as long as it lasts."""

from dataclasses import replace

import pytest

from navigate.pretend import PretendSession
from tendonrod.navigate.commands import Jog
from tendonrod.navigate.news import BURST, News
from tendonrod.navigate.snapshot import Notice

FIRST = PretendSession().snapshot


def told(news, **what):
    return news.of(replace(FIRST, **what))


def notice(code="pressure", severity="limit", text="5.0 kPa is too much"):
    return (Notice(code=code, text=text, severity=severity),)


def test_a_target_is_told_once_until_it_is_forgotten():
    news = News(FIRST)
    assert told(news, reached=("ventral@T10",)) == [("info", "target ventral@T10 is reached")]
    assert told(news, reached=("ventral@T10",)) == []
    assert told(news, reached=()) == []
    assert told(news, reached=("ventral@T10",)) != []


def test_what_was_reached_before_is_no_news():
    assert told(News(replace(FIRST, reached=("ventral@T10",))), reached=("ventral@T10",)) == []


def test_a_refusal_is_told_once_as_long_as_it_lasts():
    news = News(FIRST)
    assert told(news, time=1.0, blocked="insertion refused: no way") == [("limit", "insertion refused: no way")]
    for k in range(1, 100):  # every second one goes through
        assert told(news, time=1.0 + 0.5 * BURST * k, blocked="insertion refused: no way" if k % 4 else "") == []
    assert told(news, time=80.0, blocked="insertion refused: no way") != []


def test_another_motion_and_another_reason_are_told_at_once_but_not_another_number():
    news = News(FIRST)
    for k, text in enumerate(["turning + refused: by 5.8 mm", "insertion refused: by 5.8 mm", "insertion refused: no"]):
        assert told(news, time=1.0 + 0.1 * k, blocked=text) == [("limit", text)]
    for k in range(40):  # and they do not take turns
        text = ["insertion refused: by 0.7 mm", "insertion refused: no", "turning + refused: by 12 mm"][k % 3]
        assert told(news, time=1.3 + 0.1 * k, blocked=text) == []


@pytest.mark.parametrize(("code", "severity"), [("pressure", "limit"), ("lift-off", "warning")])
def test_passing_a_limit_or_leaving_the_model_is_told_and_again_only_after_it_was_over(code, severity):
    news = News(FIRST)
    assert told(news, time=1.0, warnings=notice(code, severity)) == [(severity, "5.0 kPa is too much")]
    for k in range(1, 30):  # it flickers, and its number changes
        shown = notice(code, severity, f"{k} kPa is too much") if k % 2 else ()
        assert told(news, time=1.0 + 0.4 * BURST * k, warnings=shown) == []
    assert len(told(news, time=30.0, warnings=notice(code, severity))) == 1


def test_mere_remarks_are_no_news():
    assert told(News(FIRST), warnings=(*notice("accuracy", "info"), *notice("inside", "warning"))) == []


def test_a_fault_of_a_bench_is_told_as_such_not_as_a_refusal():
    news = News(FIRST)
    assert news.trouble("the bench stopped: dust") == [("limit", "the bench stopped: dust")]
    assert told(news, blocked="the bench stopped: dust") == news.trouble("the bench stopped: dust") == []
    assert news.trouble("") == [("info", "the bench obeys again")]


@pytest.mark.parametrize(
    ("jog", "words"),
    [
        (Jog(insertion=1e-3), "insertion"), (Jog(rotation=-0.1), "turning −"),
        (Jog(insertion=-1e-3, tension=0.1), "retraction and pulling"), (Jog(), "motion"),
    ],
)  # fmt: skip
def test_a_motion_has_a_name(jog, words):
    assert jog.words() == words
