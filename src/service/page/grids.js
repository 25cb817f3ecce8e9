// Answers of studies as they are drawn: a map's rows become columns over its whole grid, quick to look up and cheap to keep.

/** A map over its grid: of each variant the quantities, not a number where there are none, and why: 0 where it has an answer or was not
 *  looked at, else which of the reasons from 1. */
function gridOf({ variants, over, possible, impossible, reasons, is_complete: isComplete }) {
  const quantities = Object.fromEntries(
    Object.entries(possible.quantities).map(([name, column]) => {
      const values = new Float64Array(variants).fill(NaN);
      possible.variant.forEach((variant, row) => {
        values[variant] = column[row] ?? NaN;
      });
      return [name, values];
    }),
  );
  const reason = new Uint16Array(variants);
  impossible.variant.forEach((variant, row) => {
    reason[variant] = impossible.reason[row] + 1;
  });
  return { study: 'map', variants, axes: over, quantities, reason, reasons, isComplete };
}

/** The answer of a study of whatever kind. */
export const drawableStudy = (answer) => (answer.study === 'map' ? gridOf(answer) : answer);

/** Of many values, by their index, those that can be told apart: of each stretch the least and the largest. */
export function thinned(values, most) {
  if (values.length <= most) return Array.from(values, (_, index) => index);
  const stride = Math.ceil((2 * values.length) / most);
  const kept = [];
  for (let start = 0; start < values.length; start += stride) {
    const end = Math.min(values.length, start + stride);
    let [least, largest, gap] = [start, start, -1];
    for (let index = start; index < end; index += 1) {
      if (Number.isNaN(values[index])) gap = index;
      else {
        if (!(values[index] >= values[least])) least = index;
        if (!(values[index] <= values[largest])) largest = index;
      }
    }
    kept.push(...[...new Set([least, largest, ...(gap < 0 ? [] : [gap])])].sort((one, other) => one - other));
  }
  return kept;
}
