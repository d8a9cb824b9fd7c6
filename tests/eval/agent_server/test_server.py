"""The MCP server as agents meet it: the SDK's own client, over standard input and output."""

import json
import sys
from pathlib import Path
from typing import Any

import anyio
import pytest
from mcp import Client, StdioServerParameters

from configs.source_code import PROJECT_ROOT
from datasets.formats.bvh import write_bvh
from eval import console_command
from eval.agent_server.server import make_server
from eval.agent_server.workshop import Workshop
from eval.clean.pipeline import CleaningPipeline
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import standing


def test_an_agent_describes_cleans_explains_and_undoes(tmp_path: Path) -> None:
    write_bvh(tmp_path / "in.bvh", as_bvh(standing(60, 30.0)))
    given, out = str(tmp_path / "in.bvh"), str(tmp_path / "out.bvh")
    process = StdioServerParameters(command=sys.executable, args=["-m", "eval.agent_server", "--threads", "1"], cwd=PROJECT_ROOT)

    async def talk() -> None:
        async with Client(process) as client:
            assert [tool.name for tool in (await client.list_tools()).tools] == ["describe", "clean", "explain", "undo"]
            assert (await ask(client, "describe", path=given))["read_as"].startswith("read as: Y up, cm, 30 fps")
            cleaned = await ask(client, "clean", path=given, out=out, without=["physics"])
            assert (cleaned["frames"], cleaned["physics_share"]) == (119, 0.0)
            assert Path(out).is_file()
            assert (await ask(client, "explain", path=out))["cleaned"] is True
            refused = await client.call_tool("clean", {"path": given, "out": given})
            assert refused.is_error
            assert "was not written by this server" in str(refused.content)
            assert (await ask(client, "undo", path=out))["done"] == f"{out} was removed"
            assert not Path(out).exists()

    anyio.run(talk)


async def ask(client: Client, tool: str, **arguments: Any) -> dict[str, Any]:
    """Return the answer of a tool."""
    answer = await client.call_tool(tool, arguments)
    assert not answer.is_error, answer.content
    assert answer.structured_content is not None
    assert json.loads(answer.content[0].text) == answer.structured_content  # type: ignore[union-attr]
    return answer.structured_content


def test_progress_is_told(tmp_path: Path) -> None:
    write_bvh(tmp_path / "in.bvh", as_bvh(standing(60, 30.0)))
    told = []

    async def note(progress: float, total: float | None, message: str | None) -> None:
        told.append(message)

    async def talk() -> None:
        async with Client(make_server(Workshop(1, CleaningPipeline(None)))) as client:
            await client.call_tool("explain", {"path": str(tmp_path / "in.bvh")}, progress_callback=note)

    anyio.run(talk)
    assert told[0] == "restoring poses"
    assert "holding feet" in told


@pytest.mark.parametrize("package", ["anyio", "mcp", "mcp_types"])
def test_a_missing_package_is_told_in_a_line(package: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delitem(sys.modules, "eval.agent_server.server")
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        monkeypatch.setitem(sys.modules, name, None)
    assert console_command.main(["mcp"]) == 2
    assert (
        capsys.readouterr().err == "error: the MCP server needs the package mcp, which is not installed; pip install 'adapt-mimic[mcp]'\n"
    )
