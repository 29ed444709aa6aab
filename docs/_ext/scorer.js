// Scores of the manual's search: what a user can import from halfdof_ctrl stands first, then the members of that,
// then pages. Names by which the reference reaches into the rooms of the package come after the pages about them.
var Scorer = {
  score: ([docname, title, anchor, descr, score, filename, kind]) => {
    if (kind !== "object") return kind === "index" ? 0 : score; // an index entry repeats an object
    const parts = title.split(".");
    const named = score > 5; // the last part of the name matches, not only the path to it
    if (parts.length === 2 || parts[1] === "errors") return named ? score + 30 : score;
    return /^[A-Z]/.test(parts[1]) ? score : score - (score >= 16 ? 2 : 12);
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
