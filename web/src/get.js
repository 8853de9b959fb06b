/** `fetch`, and in Node, whose own knows no files, those too. */
export async function get(url, options) {
  if (url.protocol !== "file:") return fetch(url, options);
  const { readFile } = await import(/* webpackIgnore: true */ /* @vite-ignore */ "node:fs/promises");
  try {
    return new Response(await readFile(url));
  } catch (error) {
    return new Response(null, { status: 404, statusText: error.message });
  }
}
