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
  // The steps that are due by then lie between poses from before and after the refused one.
  await new Promise((resolve) => setTimeout(resolve, 100));
  await tissue.frame([far]);
  await new Promise((resolve) => setTimeout(resolve, 100));
  list.push(await said(() => tissue.frame([far])));
  tissue.close();
  list.push(await said(() => tissue.frame()));
  return list;
})()
  .catch((error) => [String(error)])
  .then((list) => {
    window.said = list;
  });
