// Two pictures of one size on one another, and a range that moves the edge between them:
// <before-after>![before](a.webp)![after](b.webp)</before-after>, with data-before and data-after as labels.
customElements.define(
  "before-after",
  class extends HTMLElement {
    connectedCallback() {
      const [before, after] = this.querySelectorAll("img");
      if (!after || this.classList.contains("ready")) return;
      const names = [this.dataset.before || "before", this.dataset.after || "after"];
      const range = document.createElement("input");
      range.type = "range";
      range.max = 100;
      range.value = 50;
      range.setAttribute("aria-label", `Edge between ${names[0]} and ${names[1]}, from the left: ${after.alt}`);
      range.addEventListener("input", () => {
        this.style.setProperty("--at", `${range.value}%`);
        range.setAttribute("aria-valuetext", `${range.value} % ${names[0]}`);
      });
      const edge = document.createElement("span");
      edge.className = "edge";
      const labels = names.map((name) => {
        const label = document.createElement("span");
        label.className = "label";
        label.textContent = name;
        label.ariaHidden = "true";
        return label;
      });
      this.replaceChildren(before, after, range, edge, ...labels);
      this.classList.add("ready");
    }
  },
);
