"""Lanes as pieces of the page; whatever comes from a file or a person is shown as text."""

import html

from addb_viewer.trial_view.chart_html import GUTTER, MARGIN
from addb_viewer.trial_view.lanes import Block, Lane
from addb_viewer.trial_view.span import Span

LANE = 16  # [pixel] with the line between two


def lanes_html(lanes: tuple[Lane, ...], span: Span) -> str:
    """All lanes; `LANE` pixels each."""
    return "".join(_lane_html(lane, span) for lane in lanes)


def _lane_html(lane: Lane, span: Span) -> str:
    blocks = "".join(_block_html(block, span) for block in lane.blocks)
    return (
        f"<div style='position:relative;height:{LANE}px'>"
        f"<div style='position:absolute;left:8px;top:1px;opacity:.8'>{html.escape(lane.label)}</div>"
        f"<div style='position:absolute;left:{GUTTER}px;right:{MARGIN}px;top:0;bottom:1px;overflow:hidden;"
        f"background:rgba(128,128,128,.12)'>{blocks}</div></div>"
    )


def _block_html(block: Block, span: Span) -> str:
    place = span.block(block.start, block.end)
    if place is None:
        return ""
    left, width = place
    told = f"{block.start}–{block.end - 1}: {block.told}"
    return (
        f"<div title='{html.escape(told)}' style='position:absolute;"
        f"left:{100 * left:.3f}%;width:{100 * width:.3f}%;min-width:2px;bottom:0;"
        f"height:{100 * block.height:.0f}%;"
        f"box-sizing:border-box;overflow:hidden;white-space:nowrap;text-align:center;font-weight:600;"
        f"{_surface(block)}'>{html.escape(block.text)}</div>"
    )


def _surface(block: Block) -> str:
    outline = "outline:2px solid currentColor;outline-offset:-2px;" if block.outlined else ""
    border = f"border:1px solid {block.color.css};"
    if block.hollow:
        return f"{outline}border:1.5px dashed currentColor"
    if not block.hatched:
        return f"{outline}{border}background:{block.color.css};color:{block.color.ink.css}"
    strong, weak = block.color.faded(0.55), block.color.faded(0.15)
    stripes = f"repeating-linear-gradient(135deg,{strong} 0 3px,{weak} 3px 7px)"
    return f"{outline}{border}background:{stripes}"
