// How curves are shown: over time or by gait cycle, and which other trials of the subject lie over them.
import { button, element } from "./elements.js";
import { dashOf } from "./multiples.js";

/** Makes the row of switches. choose: called with what was chosen, {by} or {over}. */
export function makeOptions(choose) {
  const isOn = (made) => made.getAttribute("aria-pressed") === "true";
  const byCycle = button("by gait cycle", () => choose({ by: isOn(byCycle) ? "time" : "cycle" }));
  const list = element("fieldset", { id: "addb-curve-trials", hidden: true, "aria-label": "Trials drawn over this one" });
  const unfold = () => {
    list.hidden = !list.hidden;
    opener.setAttribute("aria-expanded", String(!list.hidden));
  };
  const opener = button("Other trials", unfold, { "aria-expanded": "false" });
  const perKg = button("per kg", () => choose({ per_kg: !isOn(perKg) }), { title: "Torques and powers for each kilogram of the person" });
  const writer = button("CSV", () => window.addb.send("do", "curves_csv"), { title: "Write what is shown into results/curves" });
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
    part: element("div", { id: "addb-curve-options" }, byCycle, perKg, opener, writer, list, legend),
    numberOf: (name) => lying.indexOf(name),
    show(told) {
      [over, trials] = [told.over, told.trials];
      byCycle.setAttribute("aria-pressed", String(told.by === "cycle"));
      byCycle.disabled = !told.cycles;
      byCycle.title = told.cycles ? "" : "Gait cycles need a fit";
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
