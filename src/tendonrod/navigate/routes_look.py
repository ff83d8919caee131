"""What scripts and the page may see, without control: scene, state, meshes, records."""

from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Depends, HTTPException, Query, Request, Response

from ..errors import InvalidInput
from . import told, wire
from .hub import Hub
from .messages import page_schema
from .service import Service

MISSING: dict[int | str, dict[str, Any]] = {404: {"model": told.Refusal, "description": "Not there"}}
api = APIRouter(tags=["look"])


def _service(request: Request) -> Service:
    return request.app.state.service


def _hub(request: Request) -> Hub:
    return request.app.state.hub


TheService = Annotated[Service, Depends(_service)]
TheHub = Annotated[Hub, Depends(_hub)]


@api.get("/scene", response_model=told.Scene, summary="Robot, phantom, targets, limits")
async def scene(service: TheService) -> Any:
    """What stays as it is for the whole session."""
    return service.scene()


@api.get("/state", response_model=told.State, summary="The robot now")
async def state(service: TheService) -> Response:
    """The newest state, as on /ws."""
    return Response(service.state(), media_type="application/json")


@api.get(
    "/meshes/{structure}.stl",
    summary="A structure of the phantom: binary STL, m, world frame",
    response_class=Response,
    responses={200: {"content": {"model/stl": {}}}, **MISSING},
)
def mesh(structure: str, service: TheService) -> Response:
    """One of those that the scene names."""
    structures = service.begun.phantom.structures
    if structure not in structures:
        raise HTTPException(404, f"no structure of this name; there are {', '.join(structures)}")
    return Response(wire.stl(structures[structure].mesh, structure), media_type="model/stl")


@api.get("/control", summary="Who has control")
async def control(service: TheService, hub: TheHub) -> told.Who:
    """One operator at a time; everybody may look."""
    return told.Who(operator=service.seat.holder, clients=len(hub.clients))


@api.get("/records", summary="The records of this server, newest first")
def records(service: TheService) -> list[told.RecordEntry]:
    """Their names are what /api/record and /api/replay take."""
    found = [] if service.records is None else service.records.found()
    sizes = [(path.name, path.stat()) for path in found]
    return [told.RecordEntry(name=name, size=at.st_size, modified=at.st_mtime) for name, at in sizes]


@api.get(
    "/record",
    summary="One record, JSON lines; without a name the present one",
    response_class=Response,
    responses={200: {"content": {"application/x-ndjson": {}}}, **MISSING},
)
def record(service: TheService, name: Annotated[str | None, Query(max_length=100)] = None) -> Response:
    """The first line says what the session was about, each other line is a step or an event."""
    path = service.record if name is None else record_path(service, name)
    if path is None:
        raise HTTPException(404, "nothing is being recorded")
    kind = {"Content-Disposition": f'attachment; filename="{path.name}"'}
    try:
        return Response(path.read_bytes(), media_type="application/x-ndjson", headers=kind)
    except OSError as error:
        raise HTTPException(404, f"{path.name}: {error.strerror}") from None


@api.get("/messages", summary="JSON schema of the messages on /ws")
async def messages() -> dict[str, Any]:
    """What a client may send, and what it gets."""
    return page_schema()


def record_path(service: Service, name: str) -> Path | None:
    """Of the record of this name; 404 where there is none."""
    if service.records is None:
        return None
    try:
        return service.records.path(name)
    except InvalidInput as error:
        raise HTTPException(404, str(error)) from None
