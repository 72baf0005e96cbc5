"""A server whose tools refuse arguments that they do not have, and say in words what they need."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import ToolError, UnexpectedToolError
from mcp.shared.exceptions import MCPError
from mcp.types import INVALID_PARAMS, Tool
from pydantic import ValidationError

from input_files.pydantic_words import words

KINDS = {"number": "a number", "integer": "a whole number", "string": "text", "boolean": "true or false"}
"""What the JSON schema's types are called."""
UNITS = {"_mm": " of millimetres", "_deg": " of degrees", "_s": " of seconds"}
"""What the endings of arguments mean."""


class StrictServer(MCPServer[Any]):
    """Refuses unknown arguments, and describes wrong ones without pydantic's words."""

    async def list_tools(self) -> list[Tool]:
        """Return the tools, with schemas that allow no other arguments."""
        tools = await super().list_tools()
        for tool in tools:
            tool.input_schema = {**tool.input_schema, "additionalProperties": False}
        return tools

    async def call_tool(self, name: str, arguments: dict[str, Any], context: Any = None) -> Any:  # noqa: ANN401 - mcp's
        """Call a tool.

        Raises:
            ToolError: The arguments are not the tool's, or the tool refused them.
        """
        tool = next((each for each in await self.list_tools() if each.name == name), None)
        if tool is None:
            return await super().call_tool(name, arguments, context)
        for unknown in arguments.keys() - tool.input_schema["properties"].keys():
            raise ToolError(f"{name} has no argument {unknown!r}: {usage(name, tool.input_schema)}")
        try:
            return await super().call_tool(name, arguments, context)
        except ToolError as error:
            if isinstance(error, UnexpectedToolError) or not isinstance(wrong := error.__cause__, ValidationError):
                raise
            first = wrong.errors()[0]
            said = words(first["type"], first.get("ctx", {}), first["msg"], first["input"])
            raise ToolError(f"{first['loc'][0]} {said}: {usage(name, tool.input_schema)}") from None

    async def get_prompt(self, name: str, arguments: object = None, context: object = None) -> Any:  # noqa: ANN401, ARG002 - as in mcp
        """Refuse a prompt; for one that does not exist the library itself would log a traceback.

        Raises:
            MCPError: There are no prompts.
        """
        raise MCPError(INVALID_PARAMS, f"there is no prompt {name!r}. This server has tools.")


def usage(name: str, schema: Mapping[str, Any]) -> str:
    """Describe the arguments of a tool: "drive_mm needs distance_mm, a number of millimetres."."""
    needed = schema.get("required", [])
    needs: list[str] = []
    takes: list[str] = []
    for argument, about in schema["properties"].items():
        unit = next((words for ending, words in UNITS.items() if argument.endswith(ending)), "")
        kind = KINDS.get(about.get("type", ""), "")
        (needs if argument in needed else takes).append(f"{argument}, {kind}{unit}" if kind else argument)
    parts = [f"{verb} {'; '.join(listed)}" for verb, listed in (("needs", needs), ("takes", takes)) if listed]
    return f"{name} {' and '.join(parts) or 'takes no arguments'}."
