"""An explained telegram as JSON."""

from __future__ import annotations

from firmware_protocol.explain import ExplainedField, Explanation


def as_json(explanation: Explanation) -> dict[str, object]:
    """Return an explanation as plain values for JSON: bytes in hex, named values as numbers beside their words."""
    status = explanation.status
    return {
        "telegram": explanation.telegram.hex(),
        "kind": explanation.kind,
        "name": explanation.name,
        "direction": explanation.direction,
        "framed": explanation.framed,
        "want_reply": explanation.want_reply,
        "status": None if status is None else {"code": int(status), "label": status.label},
        "fields": [_field(each) for each in explanation.fields],
        "leftover": explanation.leftover.hex(),
        "remarks": list(explanation.remarks),
    }


def _field(field: ExplainedField) -> dict[str, object]:
    value = field.value
    plain: object = value.hex() if isinstance(value, bytes) else value
    if isinstance(value, int) and not isinstance(value, bool):
        plain = int(value)
    return {"name": field.name, "value": plain, "unit": field.unit, "text": field.text, "raw": field.raw.hex()}
