/** The address of a small bundle that comes with the package: a block of 80 x 80 x 40 mm that its bottom holds, its top at z = 40 mm. */
declare const block: URL;
export default block;
