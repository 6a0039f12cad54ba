"use strict";
(() => {
  const PAGE = 48; // cards that are made at a time
  const byId = (id) => document.getElementById(id);

  /* An element with text and children; nothing from the data ever becomes HTML. */
  function make(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  // --- light and dark -------------------------------------------------------------------------------------
  const system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => {
    const chosen = document.documentElement.dataset.theme;
    return chosen ? chosen === "dark" : system.matches;
  };
  function themeChanged() {
    for (const picture of document.querySelectorAll("img[src]")) decode(picture);
  }
  system.addEventListener("change", themeChanged);
  for (const option of document.querySelectorAll(".themes input")) {
    option.addEventListener("change", () => {
      if (option.value) document.documentElement.dataset.theme = option.value;
      else delete document.documentElement.dataset.theme;
      themeChanged();
    });
  }

  // --- tables ---------------------------------------------------------------------------------------------
  function sortBy(button) {
    const heading = button.closest("th");
    const table = button.closest("table");
    const column = Number(button.dataset.sort);
    const descending = heading.getAttribute("aria-sort") === "ascending";
    const valueOf = (row) => {
      const cell = row.cells[column];
      if (cell.dataset.v === undefined) return cell.textContent;
      return cell.dataset.v === "" ? NaN : Number(cell.dataset.v);
    };
    const rows = [...table.tBodies[0].rows].map((row) => [valueOf(row), row]);
    rows.sort(([one], [other]) => compare(one, other, descending));
    table.tBodies[0].append(...rows.map(([, row]) => row));
    for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
  }
  /* What isn't known stands last in either order. */
  function compare(one, other, descending) {
    if (typeof one === "number") {
      if (Number.isNaN(one) || Number.isNaN(other)) return Number.isNaN(one) - Number.isNaN(other);
      return descending ? other - one : one - other;
    }
    return (descending ? -1 : 1) * one.localeCompare(other, undefined, { numeric: true });
  }
  for (const button of document.querySelectorAll(".sortable th button")) {
    button.addEventListener("click", () => sortBy(button));
    const body = button.closest("table").tBodies[0];
    const first = body.rows[0] && body.rows[0].cells[Number(button.dataset.sort)];
    if (first && first.classList.contains("n")) button.closest("th").classList.add("n");
  }

  // --- frames ---------------------------------------------------------------------------------------------
  const source = byId("frames-data");
  if (!source) return;
  const data = JSON.parse(source.textContent);
  const rows = data.rows.map(([scene, camera, index, time, drivable, vehicles, speed, lacks, predicted, line]) => ({
    scene, camera, index, time, drivable, vehicles, speed, lacks, predicted, line,
  }));

  /* A picture of a frame, as it stands in the page: line by line, those of a frame divided by bars. */
  function pictureText(row, place) {
    const block = byId(`p${row.scene}`);
    return block ? block.textContent.split("\n")[row.line].split("|")[place] : null;
  }
  const PHOTO = [0, 0];
  const PLANE = [1, 2]; // places in the dark and in the light theme
  const difference = (number, target) => [3 + 4 * number + 2 * target, 4 + 4 * number + 2 * target];

  const waiting = new WeakMap(); // picture → [row, places]
  function decode(picture) {
    const [row, places] = waiting.get(picture);
    const text = pictureText(row, places[isDark() ? 0 : 1]);
    if (text) picture.src = `data:image/webp;base64,${text}`;
  }
  const seen = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        seen.unobserve(entry.target);
        if (document.readyState === "loading") {
          document.addEventListener("DOMContentLoaded", () => decode(entry.target), { once: true });
        } else decode(entry.target);
      }
    },
    { rootMargin: "400px" },
  );
  function picture(row, places, text) {
    const made = make("img", { alt: text });
    waiting.set(made, [row, places]);
    seen.observe(made);
    return made;
  }

  const percent = (share) => (share === null ? "–" : `${(100 * share).toFixed(1)} %`);
  const nameOf = (row) => data.scenes[row.scene];
  const whenOf = (row) => `${row.time.toFixed(1)} s`;
  const lacksOf = (row) => row.lacks.map((one) => data.lacks[one]).join("; ");

  /* Cards in a grid: made as the reader scrolls, one of them in the tab order, arrows move between them. */
  class Gallery {
    constructor(root, end, cardOf) {
      this.root = root;
      this.cardOf = cardOf;
      this.rows = [];
      new IntersectionObserver((entries) => entries.some((one) => one.isIntersecting) && this.grow(), {
        rootMargin: "800px",
      }).observe(end);
      root.addEventListener("keydown", (event) => this.move(event));
      root.addEventListener("click", (event) => {
        const card = event.target.closest(".card");
        if (card) view(this, [...root.children].indexOf(card));
      });
    }
    show(shown) {
      this.rows = shown;
      this.root.replaceChildren();
      this.grow();
    }
    grow() {
      const from = this.root.childElementCount;
      const cards = this.rows.slice(from, from + PAGE).map((row) => this.cardOf(row));
      cards.forEach((card, place) => (card.tabIndex = from + place ? -1 : 0));
      this.root.append(...cards);
    }
    focus(number) {
      while (number >= this.root.childElementCount && this.root.childElementCount < this.rows.length) this.grow();
      const card = this.root.children[number];
      if (!card) return;
      for (const other of this.root.querySelectorAll('[tabindex="0"]')) other.tabIndex = -1;
      card.tabIndex = 0;
      card.focus();
    }
    move(event) {
      const cards = [...this.root.children];
      const columns = cards.filter((card) => card.offsetTop === cards[0].offsetTop).length;
      const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns }[event.key];
      const from = cards.indexOf(document.activeElement);
      const to = { Home: 0, End: cards.length - 1 }[event.key] ?? from + step;
      if (from < 0 || Number.isNaN(to) || to < 0 || to >= this.rows.length) return;
      event.preventDefault();
      this.focus(to);
    }
  }

  function caption(row, right) {
    return make("span", { class: "caption" }, make("b", {}, nameOf(row)), make("span", {}, right));
  }
  function frameCard(row) {
    const name = `${nameOf(row)}, ${data.cameras[row.camera]}, frame ${row.index}`;
    const pictures = make("span", { class: "pics" }, picture(row, PHOTO, name), picture(row, PLANE, "from above"));
    const card = make("button", { type: "button", class: "card" }, pictures, caption(row, noteOf(row)));
    if (row.lacks.length) card.append(make("span", { class: "lacks" }, lacksOf(row)));
    return card;
  }
  function noteOf(row) {
    const [run, target] = sorting();
    const found = run === null ? null : row.predicted.find(([number]) => number === run);
    return found ? `IoU ${percent(found[1 + target])}` : whenOf(row);
  }

  // --- one frame, large -----------------------------------------------------------------------------------
  const viewer = byId("viewer");
  let viewed = null; // [gallery, number]
  function view(gallery, number) {
    viewed = [gallery, number];
    const row = gallery.rows[number];
    const large = (title, places) =>
      make("figure", {}, make("figcaption", {}, title), picture(row, places, title));
    byId("viewer-title").textContent = `${nameOf(row)}, frame ${row.index}`;
    byId("viewer-place").textContent = `${number + 1} of ${gallery.rows.length.toLocaleString("en")}`;
    byId("viewer-pictures").replaceChildren(
      large(data.cameras[row.camera], PHOTO),
      large("from above", PLANE),
      ...row.predicted.flatMap(([run], place) =>
        data.targets.map((target, number) => large(`${data.runs[run]}: ${target}`, difference(place, number))),
      ),
    );
    const facts = {
      Time: whenOf(row),
      Drivable: percent(row.drivable),
      Vehicles: String(row.vehicles),
      Speed: row.speed === null ? "not known" : `${row.speed.toFixed(1)} m/s`,
      Lacks: lacksOf(row) || "nothing",
    };
    for (const [run, ...ious] of row.predicted) {
      facts[data.runs[run]] = data.targets.map((target, place) => `${target} ${percent(ious[place])}`).join(", ");
    }
    byId("viewer-facts").replaceChildren(
      ...Object.entries(facts).map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))),
    );
    if (!viewer.open) viewer.showModal();
  }
  function step(by) {
    const [gallery, number] = viewed;
    if (number + by >= 0 && number + by < gallery.rows.length) view(gallery, number + by);
  }
  viewer.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by) step(by);
  });
  viewer.addEventListener("close", () => viewed[0].focus(viewed[1]));
  byId("viewer-before").addEventListener("click", () => step(-1));
  byId("viewer-after").addEventListener("click", () => step(1));
  byId("viewer-close").addEventListener("click", () => viewer.close());

  // --- filters --------------------------------------------------------------------------------------------
  const filters = byId("filters");
  /* The run and target that frames are sorted by; null, null in their own order. */
  function sorting() {
    const [run, target] = filters.elements.sort.value.split(" ").map(Number);
    return Number.isInteger(target) ? [run, target] : [null, null];
  }
  function wanted(row) {
    const { scene, camera, validity } = filters.elements;
    if (!nameOf(row).toLowerCase().includes(scene.value.trim().toLowerCase())) return false;
    if (camera.value !== "" && row.camera !== Number(camera.value)) return false;
    if (validity.value === "whole") return row.lacks.length === 0;
    if (validity.value === "lacking") return row.lacks.length > 0;
    return validity.value === "" || row.lacks.includes(Number(validity.value));
  }
  /* Those of a run by the IoU of a target, the worst first; where there is nothing, none. */
  function worst(found, run, target) {
    const scored = found.flatMap((row) => {
      const one = row.predicted.find(([number]) => number === run);
      return one && one[1 + target] !== null ? [[one[1 + target], row]] : [];
    });
    return scored.sort(([one], [other]) => one - other).map(([, row]) => row);
  }
  const gallery = new Gallery(byId("gallery"), byId("more"), frameCard);
  function filter() {
    const found = rows.filter(wanted);
    const [run, target] = sorting();
    const sorts = { "": (ones) => ones, vehicles: (ones) => ones.sort((one, other) => other.vehicles - one.vehicles) };
    gallery.show(run === null ? sorts[filters.elements.sort.value](found) : worst(found, run, target));
    byId("shown").textContent = `${gallery.rows.length.toLocaleString("en")} of ${rows.length.toLocaleString("en")}`;
  }
  filters.addEventListener("input", filter);
  filters.addEventListener("submit", (event) => event.preventDefault());
  filter();

  // --- examples of confusion ------------------------------------------------------------------------------
  const choice = byId("confused");
  if (!choice) return;
  const confused = new Gallery(byId("examples-gallery"), byId("examples-more"), (row) => {
    const [run, target] = choice.elements.which.value.split(" ").map(Number);
    const place = row.predicted.findIndex(([number]) => number === run);
    const pictures = data.targets.map((name, number) => picture(row, difference(place, number), name));
    const note = `IoU ${percent(row.predicted[place][1 + target])}`;
    return make(
      "button", { type: "button", class: "card" }, make("span", { class: "pics" }, ...pictures), caption(row, note),
    );
  });
  function confuse() {
    const [run, target] = choice.elements.which.value.split(" ").map(Number);
    confused.show(worst(rows, run, target));
  }
  choice.addEventListener("input", confuse);
  confuse();
})();
