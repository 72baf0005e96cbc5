// The results of a classroom: a table that sorts by any column and can be copied into a spreadsheet.

const COLUMNS = [
  ["robot", ({ robot }) => robot],
  ["run", ({ run }) => run],
  ["mission", ({ mission }) => mission],
  ["ending", ({ ending }) => ending],
  ["targets reached", ({ reached }) => reached],
  ["of", ({ targets }) => targets],
  ["seconds", ({ seconds }) => (seconds === null ? "" : seconds.toFixed(1))],
];
const order = new Intl.Collator(undefined, { numeric: true });

export class Results {
  constructor(find) {
    this.find = find;
    this.rows = [];
    this.column = 0;
    this.down = false;
    this.heads = COLUMNS.map(([title], column) => {
      const head = document.createElement("th"), button = document.createElement("button");
      head.scope = "col";
      button.type = "button";
      button.textContent = title;
      button.addEventListener("click", () => this.sort(column));
      head.append(button);
      return head;
    });
    find("results").tHead.rows[0].replaceChildren(...this.heads);
    find("copy").addEventListener("click", () => this.copy());
  }

  async fetch() {
    const answer = await fetch("api/results");
    if (!answer.ok) return;
    this.rows = await answer.json();
    this.show();
  }

  sort(column) {
    this.down = column === this.column && !this.down;
    this.column = column;
    this.show();
  }

  show() {
    const { column, down } = this, [, sorted] = COLUMNS[column];
    this.rows.sort((one, other) => order.compare(sorted(one), sorted(other)) * (down ? -1 : 1));
    this.heads.forEach((head, number) => head.setAttribute("aria-sort", number !== column ? "none" : down ? "descending" : "ascending"));
    const rows = this.rows.map((result) => {
      const row = document.createElement("tr");
      for (const [title, value] of COLUMNS) row.insertCell().append(title === "run" ? replay(result) : value(result));
      return row;
    });
    this.find("results").tBodies[0].replaceChildren(...rows);
    this.find("results").hidden = this.find("copy").hidden = !rows.length;
    this.find("no-results").hidden = rows.length > 0;
  }

  // over plain HTTP a browser offers no clipboard but this one
  copy() {
    const range = document.createRange();
    range.selectNode(this.find("results"));
    getSelection().removeAllRanges();
    getSelection().addRange(range);
    const copied = document.execCommand("copy");
    getSelection().removeAllRanges();
    this.find("copy").textContent = copied ? "Copied" : "Press Ctrl-C";
    if (!copied) getSelection().addRange(range);
    setTimeout(() => (this.find("copy").textContent = "Copy"), 3000);
  }
}

function replay({ robot, run }) {
  const link = document.createElement("a");
  link.href = `robot/${encodeURIComponent(robot)}/replay.html?run=${encodeURIComponent(run)}`;
  link.textContent = run;
  return link;
}
