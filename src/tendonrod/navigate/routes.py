"""The web application: the page's files, its socket, and the HTTP interface for scripts (`/api/openapi.json`)."""

from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response, WebSocket
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles

from .. import __version__
from ..errors import TendonrodError
from . import routes_look, routes_steer, told
from .hub import Hub, sentence
from .service import Refused, Service

PAGE = Path(__file__).with_name("web")
ABOUT = """Steer a tendon-driven robot through a phantom, from scripts. SI units and radians; world frame: +x dorsal,
+y the patient's right, +z cranial. One operator at a time: POST /api/take gives a key, which goes with every request
that moves or changes something, as the header X-Key. Requests carry JSON. On another address than the loopback one,
every request carries the token, as `Authorization: Bearer TOKEN`. The page's messages on /ws: /api/messages."""
REFUSALS: dict[int | str, dict[str, Any]] = {
    400: {"model": told.Refusal, "description": "Not this server's name, or no JSON"},
    401: {"model": told.Refusal, "description": "The token is missing"},
    403: {"model": told.Refusal, "description": "No control, or another page's request"},
    409: {"model": told.Refusal, "description": "The session, as it is now, cannot do that"},
    413: {"model": told.Refusal, "description": "Too large"},
    415: {"model": told.Refusal, "description": "No JSON"},
    422: {"model": told.Refusal, "description": "A value outside what is allowed, in one sentence"},
}


def make_app(service: Service, hub: Hub) -> FastAPI:
    """The application, without the door in front of it (`doors`)."""
    app = FastAPI(
        title="tendonrod navigate", version=__version__, description=ABOUT,
        docs_url=None, redoc_url=None, openapi_url="/api/openapi.json",
    )  # fmt: skip
    app.state.service, app.state.hub, app.state.scripts = service, hub, routes_steer.Scripts(service, hub)
    for api in (routes_look.api, routes_steer.api):
        app.include_router(api, prefix="/api", responses=REFUSALS)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(Refused, _refused)
    app.add_exception_handler(TendonrodError, _conflict)
    _serve_page(app, hub)
    return app


def _serve_page(app: FastAPI, hub: Hub) -> None:
    @app.get("/", include_in_schema=False)
    async def page() -> Response:
        if not (PAGE / "index.html").is_file():
            return JSONResponse({"detail": "this installation has no page; the HTTP interface works"}, 404)
        return FileResponse(PAGE / "index.html")

    @app.websocket("/ws")
    async def connect(socket: WebSocket) -> None:
        await hub.serve(socket)

    app.mount("/static", StaticFiles(directory=PAGE, check_dir=False), name="static")


async def _invalid(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return JSONResponse({"detail": sentence(error.errors())}, 422)


async def _refused(request: Request, error: Exception) -> JSONResponse:
    return JSONResponse({"detail": str(error)}, 403)


async def _conflict(request: Request, error: Exception) -> JSONResponse:
    return JSONResponse({"detail": str(error)}, 409)
