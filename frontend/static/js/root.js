// Where the plant of this page is served: "" alone, "/p/KEY" among several. Paths in JSON begin at the root of the plant.
const root = document.documentElement.dataset.root ?? "";

export const here = (path) => `${root}${path}`;
