// Numbers as a person reads them.

export function length(metres) {
  if (!Number.isFinite(metres)) return '–';
  const size = Math.abs(metres);
  if (size >= 1) return `${metres.toPrecision(3)} m`;
  if (size >= 1e-4 || size === 0) return `${Number((metres * 1e3).toPrecision(3))} mm`;
  return `${Number((metres * 1e6).toPrecision(2))} µm`;
}

export const seconds = (value) => `${value.toFixed(value < 100 ? 2 : 1)} s`;
export const count = (value) => value.toLocaleString('en');
