"""What is told of a session that moves: each target once, refusals once in a burst."""

from dataclasses import replace

from navigate.pretend import PretendSession
from tendonrod.navigate.news import BURST, News

FIRST = PretendSession().snapshot


def told(news, **what):
    return news.of(replace(FIRST, **what))


def test_a_target_is_told_once_until_it_is_forgotten():
    news = News(FIRST)
    assert told(news, reached=("ventral@T10",)) == [("info", "target ventral@T10 is reached")]
    assert told(news, reached=("ventral@T10",)) == []
    assert told(news, reached=()) == []
    assert told(news, reached=("ventral@T10",)) != []


def test_what_was_reached_before_is_no_news():
    assert told(News(replace(FIRST, reached=("ventral@T10",))), reached=("ventral@T10",)) == []


def test_refusals_are_told_once_in_a_burst():
    news = News(FIRST)
    assert told(news, time=1.0, blocked="no way") == [("limit", "refused: no way")]
    for k in range(1, 100):  # every second one goes through, and the reasons change
        assert told(news, time=1.0 + 0.5 * BURST * k, blocked="no way" if k % 4 else "") == []
    assert told(news, time=80.0, blocked="another") == [("limit", "refused: another")]
