"""The robot for an assistant: tools over the Model Context Protocol."""
