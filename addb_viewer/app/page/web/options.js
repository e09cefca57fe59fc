// How curves are shown: over time or by gait cycle, and which other trials of the subject lie over them.
import { element } from "./elements.js";
import { dashOf } from "./multiples.js";

/** Makes the row of switches. choose: called with what was chosen, {by} or {over}. */
export function makeOptions(choose) {
  const switches = Object.entries({ time: "over time", cycle: "by gait cycle" }).map(([by, words]) => {
    const button = element("button", { textContent: words });
    button.onclick = () => choose({ by });
    return [by, button];
  });
  const group = element("span", { className: "addb-switch" }, ...switches.map(([, button]) => button));
  group.setAttribute("role", "group");
  group.setAttribute("aria-label", "Curves over");
  const opener = element("button", { textContent: "Other trials" });
  const list = element("fieldset", { id: "addb-curve-trials", hidden: true });
  list.setAttribute("aria-label", "Trials drawn over this one");
  opener.onclick = () => {
    list.hidden = !list.hidden;
    opener.setAttribute("aria-expanded", String(!list.hidden));
  };
  opener.setAttribute("aria-expanded", "false");
  const perKg = element("button", { textContent: "per kg", title: "Torques and powers for each kilogram of the person" });
  perKg.onclick = () => choose({ per_kg: perKg.getAttribute("aria-pressed") !== "true" });
  const writer = element("button", { textContent: "CSV", title: "Write what is shown into results/curves" });
  writer.onclick = () => window.addb.send("do", "curves_csv");
  const legend = element("span", { id: "addb-curve-over" });
  let over = [], trials = [], lying = []; // lying: over the charts, in the order of their dashes

  const drawList = () =>
    list.replaceChildren(
      ...trials.map((name) => {
        const box = element("input", { type: "checkbox", checked: over.includes(name) });
        box.onchange = () => choose({ over: box.checked ? [...over, name] : over.filter((each) => each !== name) });
        return element("label", {}, box, ` ${name}`);
      }),
    );
  return {
    part: element("div", { id: "addb-curve-options" }, group, perKg, opener, writer, list, legend),
    numberOf: (name) => lying.indexOf(name),
    show(told) {
      [over, trials] = [told.over, told.trials];
      for (const [by, button] of switches) {
        button.setAttribute("aria-pressed", String(by === told.by));
        button.disabled = !told.cycles && by === "cycle";
        button.title = button.disabled ? "Gait cycles need a fit" : "";
      }
      perKg.setAttribute("aria-pressed", String(told.per_kg));
      perKg.hidden = !told.cycles;
      opener.hidden = !trials.length;
      list.hidden ||= !trials.length;
      drawList();
    },
    drawn(names) {
      lying = names;
      legend.replaceChildren(
        ...names.map((name, i) => {
          const sample = element("canvas", { width: 26, height: 8 });
          const pen = sample.getContext("2d");
          pen.setLineDash(dashOf(i));
          pen.strokeStyle = getComputedStyle(legend).color;
          pen.lineWidth = 1.5;
          pen.moveTo(0, 4);
          pen.lineTo(26, 4);
          pen.stroke();
          return element("span", {}, sample, ` ${name}`);
        }),
      );
    },
  };
}
