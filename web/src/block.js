// The address of a small bundle that comes with the package: a block of 80 x 80 x 40 mm that its bottom holds, its top at z = 40 mm.
// Bundlers would look for one file at `new URL(..., import.meta.url)`, where this is a folder.
const here = import.meta.url;

export default new URL("./block/", here);
