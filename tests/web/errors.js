// Run in the site's page by page.py: what a worker says to bundles that are not there or damaged, to a NaN, and after its end.
(async () => {
  const { Tissue } = await import(new URL("libupt/worker.js", location.href));
  const said = async (make) => {
    try {
      await make();
      return "nothing";
    } catch (error) {
      return `${error.status}: ${error.message}`;
    }
  };
  const list = [await said(() => Tissue.open("bundles/none", { gzip: true })), await said(() => Tissue.open({ "bundle.json": new Uint8Array(9) }, { gzip: true }))];
  const tissue = await Tissue.open("bundles/liver", { gzip: true });
  const far = { position: [500, 0, 0], radius: 5 };
  await tissue.attach(tissue.positions.slice(0, 6));
  const { displacement, points } = await tissue.frame([far]);
  list.push(`${points.length} of ${displacement.length === tissue.positions.length}`);
  list.push(await said(() => tissue.frame([{ ...far, position: [NaN, 0, 0] }])));
  list.push(`${(await tissue.frame([far])).displacement.length > 0}`);
  tissue.close();
  list.push(await said(() => tissue.frame()));
  return list;
})()
  .catch((error) => [String(error)])
  .then((list) => {
    window.said = list;
  });
