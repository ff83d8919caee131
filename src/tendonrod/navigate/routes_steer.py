"""What scripts may do: take control, move for a while, place the tube, record, replay."""

import asyncio
import json
import secrets
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Request, Response

from . import asked, told
from .hub import Hub
from .routes_look import MISSING, TheService, record_path
from .service import Refused, Service

RENEWAL = 0.04  # s between two signs of life of a script's step
MOST_KEYS = 64
ACKNOWLEDGED = asked.Acknowledgement()
NOTHING = asked.Nothing()
A_SCRIPT = asked.Name()
api = APIRouter(tags=["steer"])


class Scripts:
    """The scripts that took control, by their keys."""

    def __init__(self, service: Service, hub: Hub) -> None:
        self.service, self.hub = service, hub
        self.names: dict[str, str] = {}

    def take(self, name: str) -> told.Seated:
        """Give control to a script of this name. Raises `Refused`."""
        who, key = self.hub.new_name(name), secrets.token_urlsafe(24)
        self.service.take(who)
        self.names[key] = who
        while len(self.names) > MOST_KEYS:
            self.names.pop(next(iter(self.names)))
        return told.Seated(operator=who, key=key)

    def who(self, key: str) -> str:
        """The script that has this key, and control. Raises `Refused`."""
        who = self.names.get(key, "")
        if reason := self.service.seat.refusal(who):
            raise Refused(reason)
        self.service.seat.heard(who)
        return who


def _scripts(request: Request) -> Scripts:
    return request.app.state.scripts


async def _operator(
    scripts: Annotated[Scripts, Depends(_scripts)],
    key: Annotated[str, Header(alias="X-Key", description="From /api/take")] = "",
) -> str:
    return scripts.who(key)


Who = Annotated[str, Depends(_operator)]


@api.post("/take", summary="Take control")
async def take(scripts: Annotated[Scripts, Depends(_scripts)], body: asked.Name = A_SCRIPT) -> told.Seated:
    """Granted if nobody has it, or if who has it has been silent for 10 s."""
    return scripts.take(body.name)


@api.post("/release", summary="Give control back", status_code=204)
async def release(service: TheService, who: Who, body: asked.Nothing = NOTHING) -> None:
    """The key opens nothing any more."""
    service.leave(who, "control released")


@api.post("/stop", summary="Stop at once", status_code=204)
async def stop(
    service: TheService,
    scripts: Annotated[Scripts, Depends(_scripts)],
    key: Annotated[str, Header(alias="X-Key", description="From /api/take")] = "",
    body: asked.Nothing = NOTHING,
) -> None:
    """Needs no control. Without the key of who has it, control must be taken again before anything moves."""
    service.stopped_by(scripts.names.get(key, "a script"))


@api.post("/step", response_model=told.Stepped, summary="Move for a while, in real time")
async def step(body: asked.Step, service: TheService, who: Who, request: Request) -> Response:
    """Answers when the motion is done. It ends early where somebody stops it or the connection is lost.

    ``seconds_done`` and ``ended_early`` say how far it got and why not further. The robot stands while the server is
    too busy to look after the connection, then goes on.
    """
    serial, switch = service.jog(who, body, body.duration), service.pilot.dead_man
    while switch.renew(serial) or switch.resume(serial):
        service.seat.heard(who)
        if (trouble := service.pilot.session.trouble) is not None:
            switch.let_go(trouble.text)
            break
        await asyncio.sleep(RENEWAL)
        if await request.is_disconnected():
            service.stop(f"connection of {who} lost: stopped")
            break
    await asyncio.wrap_future(service.pilot.settled())
    seconds, why = switch.outcome(serial)
    course = {"seconds_done": round(seconds, 6), "ended_early": why or None}
    return Response(json.dumps(json.loads(service.state()) | course), media_type="application/json")


@api.post("/place", response_model=told.State, summary="Place the outer tube")
async def place(body: asked.Tube, service: TheService, who: Who) -> Response:
    """The robot must be retracted. What is left out stays as it is."""
    await asyncio.wrap_future(service.place(who, body))
    return _newest(service)


@api.post("/reset", response_model=told.State, summary="Retract the robot at once")
async def reset(service: TheService, who: Who, body: asked.Nothing = NOTHING) -> Response:
    """Without tension; the targets reached are forgotten."""
    await asyncio.wrap_future(service.reset(who))
    return _newest(service)


@api.post("/rates", summary="Speeds at full deflection")
async def rates(body: asked.SomeRates, service: TheService, who: Who) -> told.Settings:
    """For everybody who steers from now on. What is left out stays as it is."""
    service.set_rates(who, body)
    return service.settings()


@api.post("/coupling", summary="Whether insertion turns the robot along its helix")
async def coupling(body: asked.Switch, service: TheService, who: Who) -> told.Settings:
    """On: by the follow-the-leader law; off: the motor stands still while inserting."""
    await asyncio.wrap_future(service.couple(who, body.on))
    return service.settings()


@api.post("/acknowledge", response_model=told.State, summary="Let the bench obey again after a fault")
async def acknowledge(service: TheService, who: Who, body: asked.Acknowledgement = ACKNOWLEDGED) -> Response:
    """Nothing moves by it, unless the fault says that it homes. Once ``fault`` of the state is null, it is done."""
    await asyncio.wrap_future(service.acknowledge(who, body.home))
    return _newest(service)


@api.post("/recording", response_model=told.State, summary="Begin or end a record")
async def recording(body: asked.Switch, service: TheService, who: Who) -> Response:
    """A record begins with the robot retracted."""
    await asyncio.wrap_future(service.set_recording(who, body.on))
    return _newest(service)


@api.post("/replay", summary="Show a record to everybody", status_code=204, responses=MISSING)
async def play(body: asked.Played, service: TheService, who: Who) -> None:
    """Nothing can be moved meanwhile."""
    record_path(service, body.name)
    await asyncio.wrap_future(service.play(who, body.name, body.speed))


@api.post("/replay/set", summary="Speed, pause and place of the record that is shown", status_code=204)
async def set_playback(body: asked.Playback, service: TheService, who: Who) -> None:
    """What is left out stays as it is."""
    await asyncio.wrap_future(service.set_playback(who, body))


@api.post("/replay/stop", summary="Back to the live session", status_code=204)
async def stop_playing(service: TheService, who: Who, body: asked.Nothing = NOTHING) -> None:
    """As it was before."""
    await asyncio.wrap_future(service.stop_playing(who))


def _newest(service: Service) -> Response:
    return Response(service.state(), media_type="application/json")
