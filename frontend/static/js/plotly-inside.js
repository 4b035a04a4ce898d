// The parts of plotly.js that it does not document, and we need: nothing else reaches into them (tests/web/test_plotly_inside.py).
//
//   axisOf(plot, name)        "x", "y2" …; undefined where the chart has none
//   valueOn(axis, written)    a value of a trace or a range as the number that the axis computes with
//   pixelOn(axis, value)      where that number is, px from the left or the top of the plot's area
//   place(axis, value)        the same from the edge of the element
//   edge(axis), extent(axis)  where the axis begins in the element, and how long it is, px
//   margins(plot)             {t, b, l, r}, px
//   notes(plot)               its annotations, as they are drawn
//   heightDrawn(plot)         px
//   boxIsDrawn(plot)          a box is being dragged now

export const axisOf = (plot, name) => plot._fullLayout[`${name[0]}axis${name.slice(1)}`];
export const valueOn = (axis, written) => axis.r2l(written);
export const pixelOn = (axis, value) => axis.l2p(value);
export const place = (axis, value) => axis._offset + axis.l2p(value);
export const edge = (axis) => axis._offset;
export const extent = (axis) => axis._length;
export const margins = (plot) => plot._fullLayout._size;
export const notes = (plot) => plot._fullLayout.annotations ?? [];
export const heightDrawn = (plot) => plot._fullLayout.height;
export const boxIsDrawn = (plot) => Boolean(plot._dragging);
