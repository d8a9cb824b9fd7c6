"""The MCP server of the workshop: four tools on the official SDK."""

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import anyio
import anyio.from_thread
import anyio.to_thread
from mcp.server.mcpserver import Context, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp_types import ToolAnnotations

from configs.errors import InputError
from eval.agent_server.workshop import Workshop
from eval.clean.session import CleaningCancelled

T = TypeVar("T")
INSTRUCTIONS = (
    "Cleans human motion capture: sliding and floating feet, jitter, limbs through each other, misaligned suit sensors. "
    "describe a recording first; clean writes a new file and never overwrites a recording; explain says what was wrong, in which seconds; "
    "undo takes back what clean wrote last. Files are BVH, MVNX, AMC, FBX or glTF. Times are seconds in the recording's file."
)
_EDITS = (
    'edits, all of which may be left out: {"contacts": [{"foot": "left", "start_s": 1.0, "stop_s": 1.5, "stands": true}], '
    '"spans": [{"start_s": 2.0, "stop_s": 3.0, "keep": true}], "misalignments": {"foot_l": [0, 0, 8]}, "ground_m": 0.0, '
    '"reading": {"up_axis": "y", "unit": 0.01}}; keep is as recorded, a misalignment the rotation vector [deg] that a body is wrong by.'
)


def make_server(workshop: Workshop) -> MCPServer:
    """Return the server; its tools use the workshop one call at a time."""
    server = MCPServer("adapt-mimic", instructions=INSTRUCTIONS, log_level="WARNING")
    one_at_a_time = anyio.Lock()

    async def work(ctx: Context, ask: Callable[..., T]) -> T:
        """Run a question to the workshop in a thread, with its progress told and its cancellation passed on."""
        stop = threading.Event()

        def progress(stage: str, share: float) -> None:
            anyio.from_thread.run(partial(ctx.report_progress, share, 1.0, stage))

        async with one_at_a_time:
            try:
                return await anyio.to_thread.run_sync(partial(ask, progress=progress, cancelled=stop.is_set), abandon_on_cancel=True)
            except InputError as error:
                raise ToolError(str(error)) from None
            except CleaningCancelled:
                raise ToolError("cancelled") from None
            finally:
                stop.set()

    @server.tool(
        description="Say what a recording is taken for: axes, unit, rate, ground, joints, and what looks wrong with how it was read.",
        annotations=ToolAnnotations(read_only_hint=True, open_world_hint=False),
    )
    async def describe(ctx: Context, path: str, edits: dict[str, Any] | None = None) -> dict[str, Any]:
        return await work(ctx, lambda progress, cancelled: workshop.describe(path, edits))

    @server.tool(
        description="Clean a recording and write the result to `out`, which must not be there yet unless this server wrote it. "
        "quality: fast, good or best. without: stages to leave out, restore or physics. " + _EDITS,
        annotations=ToolAnnotations(destructive_hint=False, idempotent_hint=True, open_world_hint=False),
    )
    async def clean(
        ctx: Context,
        path: str,
        out: str,
        quality: str | None = None,
        without: list[str] | None = None,
        edits: dict[str, Any] | None = None,
    ) -> dict[str, Any]:
        return await work(ctx, partial(workshop.clean, path, out, quality, without or [], edits))

    @server.tool(
        description="Say what was wrong with a clip, where, in which seconds, and what was done. "
        "path: what clean wrote, or a recording, which is then only looked at.",
        annotations=ToolAnnotations(read_only_hint=True, open_world_hint=False),
    )
    async def explain(ctx: Context, path: str) -> dict[str, Any]:
        return await work(ctx, partial(workshop.explain, path))

    @server.tool(
        description="Take back the last clean that wrote this file: what it held before returns, or it is removed.",
        annotations=ToolAnnotations(destructive_hint=True, open_world_hint=False),
    )
    async def undo(ctx: Context, path: str) -> dict[str, Any]:
        return await work(ctx, lambda progress, cancelled: workshop.undo(path))

    return server
