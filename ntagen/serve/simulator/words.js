// Moves and edges in words.

let model = null;

export function begin(described) { model = described; }

const templateOf = (process) => model.templates[model.processes[process].template];

export function edgeOf([process, edge]) { return templateOf(process).edges[edge]; }

export function locationOf(process, number) { return templateOf(process).locations[number].name; }

// The arrows of the picture that show an edge with its leg.
export const arrowsOf = ([process, edge, leg]) => templateOf(process).edges[edge].drawn[leg] || [];

export function edgeInWords(part) {
  const [process, , leg, select] = part, edge = edgeOf(part);
  const values = edge.select.map((name, i) => `${name}=${select[i]}`).join(", ");
  const words = [`${model.processes[process].name}: ${locationOf(process, edge.source)} → ${locationOf(process, edge.targets[leg])}`];
  if (edge.sync) words.push(edge.sync);
  if (values) words.push(`[${values}]`);
  return words.join("  ");
}

export const moveInWords = (parts) => parts.map(edgeInWords).join("  |  ");

export function labelsInWords(parts) {
  return parts.map(edgeOf).flatMap((edge) => [edge.guard, edge.update]).filter(Boolean).join("; ");
}

export function stepInWords(step) {
  const after = step.delay && step.delay !== "0" ? `after ${step.delay} ` : "";
  const who = step.who === "strategy" ? "strategy: " : "";
  return step.parts.length ? `${after}${who}${moveInWords(step.parts)}` : `${step.delay} passes`;
}

// A fraction such as 3/2 as a number.
export function numberOf(text) {
  const [above, below] = String(text).split("/").map(Number);
  return below === undefined ? above : above / below;
}
