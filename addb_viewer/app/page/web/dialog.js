// What the session asks: one dialog at a time, above all that the page shows. Texts are set as text, but for a help page
// that the server has made.
import { keyOfAction } from "./bar.js";
import { button, element } from "./elements.js";

const box = element("dialog", { id: "addb-dialog" });
document.body.append(box);
let asked = null;

const answer = (number) => window.addb.send("answer", { dialog: asked.number, button: number, text: box.querySelector("input")?.value ?? "" });

const draw = () => {
  const { title, paragraphs, html, field, wrong, buttons, keys, enter } = asked;
  const named = (text, number) => (keyOfAction(keys[number]) ? `${text} (${keyOfAction(keys[number])})` : text);
  const words = element("div", { innerHTML: html });
  const form = element("form", { method: "dialog" });
  form.onsubmit = (event) => {
    event.preventDefault();
    answer(enter);
  };
  if (field) form.append(element("label", {}, field.label, element("input", { value: field.value, autocomplete: "off" })));
  form.append(
    element("p", { className: "wrong", role: "alert" }, wrong),
    element("div", { className: "keys" }, ...buttons.map((text, number) => button(named(text, number), () => answer(number)))),
  );
  box.replaceChildren(element("h2", { id: "addb-dialog-title" }, title), ...paragraphs.map((text) => element("p", {}, text)), words, form);
  box.setAttribute("aria-labelledby", "addb-dialog-title");
};
box.addEventListener("cancel", (event) => {
  event.preventDefault(); // Escape: the session says whether it goes
  answer(asked.escape);
});
window.addb.on("dialog", (news) => {
  const again = asked && news && asked.number === news.number;
  asked = news;
  if (!news) return box.close();
  if (again) return (box.querySelector(".wrong").textContent = news.wrong);
  draw();
  if (!box.open) box.showModal();
  (box.querySelector("input") ?? box.querySelector("button")).focus();
});
