"""The site of `cargo xtask site` in headless Chromium, on a desk and on a phone.

    python3 tests/web/page.py SITE

Pictures go to web/pictures/ in UPT_BUILD_DIR. The last line is `N passed, N failed, N skipped`.
"""

from __future__ import annotations

import gzip
import json
import os
import shutil
import sys
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/view"))

from client import Browser  # noqa: E402
from host import Files, Isolated, serve  # noqa: E402

PICTURES = Path(os.environ.get("UPT_BUILD_DIR", ROOT / "target")) / "web/pictures"


def size(name: str) -> int:
    return (Path(sys.argv[1]) / "bundles/liver" / name).stat().st_size


def shown(browser: Browser, address: str, name: str) -> tuple[int, int]:
    """The page with its organ at rest, and where that is."""
    browser.open(address)
    browser.wait("window.uptView && uptView.shown > 10")
    browser.screenshot(str(PICTURES / f"{name}-rest.png"))
    x, y = browser.run("return uptView.middle")
    return x, y


def a_drag_presses(browser: Browser, address: str, name: str) -> None:
    x, y = shown(browser, address, name)
    browser.drag([(x, y), (x + 6, y), (x + 16, y + 6)], release=False)
    browser.wait("uptView.largest > 2 && uptView.contacts > 0 && uptView.force > 0")
    steps = browser.run("return uptView.steps")
    browser.wait(f"uptView.steps > {steps + 30}")
    browser.screenshot(str(PICTURES / f"{name}-pressed.png"))
    browser.release()
    browser.wait("uptView.contacts == 0")


def a_recording_comes_again(browser: Browser, address: str, name: str) -> None:
    x, y = shown(browser, address, name)
    browser.click("#record")
    browser.wait("uptView.recording")
    browser.drag([(x, y), (x + 6, y)], release=False)
    browser.wait("uptView.largest > 2")
    # Held for a second: long enough to be seen between two looks when it comes again.
    steps = browser.run("return uptView.steps")
    browser.wait(f"uptView.steps > {steps + 50}")
    browser.release()
    browser.click("#record")
    browser.wait("!uptView.recording")
    browser.click("#reset")
    browser.wait("uptView.largest < 0.01")
    browser.click("#replay")
    browser.wait("uptView.replaying && uptView.largest > 2")
    browser.wait("!uptView.replaying")


def a_grasp_pulls(browser: Browser, address: str, name: str) -> None:
    """What slides off when the tool is moved aside stays with a tool that has taken hold."""
    x, y = shown(browser, address, name)
    browser.click("#grasp")
    browser.drag([(x, y)], release=False)
    browser.wait("uptView.largest > 2 && uptView.contacts > 0")
    # It closes once it is at its depth, whenever the page comes to that; what moves before only slides.
    steps = browser.wait("uptView.grasp && uptView.steps")
    browser.wait(f"uptView.steps > {steps + 2}")
    browser.move([(x + 5 * i, y - 10 * i) for i in range(1, 7)])
    browser.wait("uptView.largest > 8 && uptView.contacts > 0")
    browser.screenshot(str(PICTURES / f"{name}-grasped.png"))
    browser.release()
    browser.wait("uptView.contacts == 0")


def a_cut_is_made_and_undone(browser: Browser, address: str, name: str) -> None:
    """The blade on the mouse, what it lays open, and the aspirator; each is taken back."""
    x, y = shown(browser, address, name)
    browser.click("[data-kind=blade]")
    browser.drag([(x - 45, y - 10), (x - 44, y - 10)], release=False)
    browser.move([(x - 44, y - 10)] * 4)
    browser.move([(x - 44 + 6 * i, y - 10 + i) for i in range(16)])
    browser.wait("uptView.copies > 0 && uptView.area > 50")
    browser.release()
    browser.wait("uptView.undos === 1 && uptView.surfaces > 1")
    browser.click("[data-kind=aspirator]")
    browser.run("document.getElementById('radius').value = 9")
    browser.drag([(x + 10, y - 30), (x + 11, y - 30)], release=False)
    browser.wait("uptView.removed > 500")
    browser.screenshot(str(PICTURES / f"{name}-cut.png"))
    browser.release()
    browser.wait("uptView.undos === 2")
    for undos in (1, 0):
        browser.click("#undo")
        browser.wait(f"uptView.undos === {undos}")
    assert browser.run("return uptView.copies + uptView.removed + uptView.area") == 0


def little_is_loaded(browser: Browser, address: str) -> None:
    """Less than 4 MB to the first dent, with a module of 0.8 MB (the tested one has more in it) and text compressed."""
    Files.sent = 0
    shown(browser, f"{address}?first", "first")
    site = Path(sys.argv[1])
    text = sum(path.stat().st_size for path in site.glob("*.js"))
    rest = Files.sent - text - (site / "libupt/upt.wasm.gz").stat().st_size
    assert 1e6 < rest < 4e6 - 0.8e6 - text / 3, (Files.sent, text, rest)


def what_has_come_is_kept(browser: Browser, address: str) -> None:
    """The next visit asks for the manifest alone; and a file whose answer ends in the middle is taken up there."""
    bundle = set(path.name for path in (Path(sys.argv[1]) / "bundles/liver").glob("*.gz"))

    def visit() -> list[tuple[str, str | None]]:
        Files.asked.clear()
        shown(browser, f"{address}?kept", "kept")
        return [one for one in Files.asked if one[0] in bundle]

    browser.open(f"{address}bundles.json")
    browser.run("caches.delete('libupt-1').then(() => { window.forgotten = true; })")
    browser.wait("window.forgotten")
    large = "prior.safetensors.gz"
    Files.breaks.add(large)
    Files.asked.clear()
    browser.open(f"{address}?kept")
    # All but half of it has come.
    manifest = (Path(sys.argv[1]) / "bundles/liver/bundle.json.gz").read_bytes()
    files = json.loads(gzip.decompress(manifest))["files"]
    sizes = {name: file["bytes"] for name, file in files.items()}
    come = 100 - 50 * sizes[large.removesuffix(".gz")] / sum(sizes.values())
    browser.wait(f"Number(/: (\\d+) %/.exec(document.body.innerText)?.[1]) > {come - 2}")
    Files.may_end.set()
    browser.wait("window.uptView && uptView.shown > 10")
    first, again = [range for name, range in Files.asked if name == large]
    assert first is None and 0 < int(again.removeprefix("bytes=").removesuffix("-")) <= size(large) // 2, again
    browser.run(
        "window.kept = 0;"
        "window.count = () => caches.open('libupt-1').then((cache) => cache.keys())"
        "  .then((all) => { window.kept = all.length; });"
    )
    browser.wait(f"count() && kept > {len(bundle)}")  # the large one is in two pieces
    assert visit() == [("bundle.json.gz", None)], Files.asked


def errors_are_told(browser: Browser, address: str) -> None:
    """A bundle that is not there, one that is damaged, a NaN, and a tissue that is closed."""
    browser.open(address)
    browser.run(Path(__file__).with_name("errors.js").read_text(encoding="utf-8"))
    said = browser.wait("window.said")
    wanted = [
        "404",
        "UPT_ERR_BUNDLE",
        "6 of true",
        "UPT_ERR_NON_FINITE",
        "true",
        "nothing",
        "UPT_ERR_HANDLE: the tissue",
    ]
    assert len(said) == len(wanted) and all(word in one for one, word in zip(said, wanted, strict=True)), said


def frames_are_shared_where_the_page_is_isolated(browser: Browser, address: str) -> None:
    """With COOP and COEP frames lie in memory that the worker writes in turn; else, and if asked, each has its own."""
    script = """
        window.found = undefined;
        (async () => {
          const { Tissue } = await import(new URL("libupt/worker.js", location.href));
          const found = { isolated: crossOriginIsolated };
          for (const shared of [true, false]) {
            const tissue = await Tissue.open("bundles/liver", { gzip: true, shared });
            await tissue.attach(tissue.positions.slice(0, 6));
            const frames = [];
            const far = { position: [500, 0, 0], radius: 5 };
            for (let i = 0; i < 7; i += 1) frames.push(await tissue.frame([far]));
            const kind = frames[0].displacement.buffer.constructor.name;
            frames[0].displacement[0] = 77;
            frames[1].points[0] = 78;
            const which = (frame) => Number(frame.displacement[0] === 77) + 2 * Number(frame.points[0] === 78);
            const same = frames.map(which).join("");
            const { length } = tissue.positions;
            const sizes = frames.every((one) => one.displacement.length === length && one.points.length === 6);
            found[shared] = [tissue.isShared, kind, same, sizes].join();
            tissue.close();
          }
          window.found = found;
        })().catch((error) => { window.found = String(error.stack); });
    """
    own = "false,ArrayBuffer,1200000,true"
    server, isolated = serve(sys.argv[1], Isolated)
    try:
        for place, shared in [(isolated, "true,SharedArrayBuffer,1201201,true"), (address, own)]:
            browser.open(place)
            browser.run(script)
            found = browser.wait("window.found")
            assert found == {"isolated": place == isolated, "true": shared, "false": own}, found
        a_drag_presses(browser, isolated, "isolated")
    finally:
        server.shutdown()


def the_example_moves(browser: Browser, address: str) -> None:
    """examples/web: a mesh of three.js follows, and so does a render mesh that it carries."""
    site = Path(sys.argv[1])
    example = site / "example"
    shutil.rmtree(example, ignore_errors=True)
    shutil.copytree(ROOT / "examples/web", example)
    shutil.copytree(ROOT / "onnx/liver-coarse", example / "bundles/liver")
    shutil.copytree(site / "libupt", example / "node_modules/libupt")
    module = gzip.decompress((site / "libupt/upt.wasm.gz").read_bytes())
    (example / "node_modules/libupt/upt.wasm").write_bytes(module)
    (example / "node_modules/three/build").mkdir(parents=True)
    shutil.copy(site / "three.js", example / "node_modules/three/build/three.module.js")
    browser.open(f"{address}example/index.html")
    browser.wait(
        "window.organ && organ.frame && organ.frame.readings.length && organ.frame.readings[0].contact_count > 0"
    )
    moved = "Math.max(...organ.frame.displacement.map(Math.abs))"
    browser.wait(f"{moved} > 1")
    browser.run("requestAnimationFrame(() => requestAnimationFrame(() => { window.drawn = true; }))")
    browser.wait("window.drawn")
    browser.screenshot(str(PICTURES / "example.png"))
    # A copy of the organ at rest as a render mesh.
    browser.run(
        "const Mesh = Object.getPrototypeOf(organ.constructor);"
        "window.twin = new Mesh(organ.geometry.clone(), organ.material);"
        "twin.geometry.attributes.position.array.set(tissue.positions);"
        "organ.carry(twin).then(() => { window.carried = true; })"
    )
    place = "geometry.attributes.position.array"
    browser.wait("window.carried && organ.frame.points")
    browser.wait(f"twin.{place}.every((x, i) => Math.abs(x - organ.{place}[i]) < 0.05) && {moved} > 1")
    # A blade in place of the ball: the mesh has the lips, in the other material.
    browser.run(
        "organ.update = async () => {};"
        "const at = 3 * tissue.domain.indexOf(1);"
        "const [x, y, z] = tissue.positions.subarray(at, at + 3);"
        "const blade = { kind: 'blade', rotation: [Math.SQRT1_2, 0, 0, Math.SQRT1_2], halfLength: 20, radius: 2 };"
        "(async () => {"
        "  for (let aside = -15; aside <= 15; aside += 1) {"
        "    organ.show(await tissue.frame([{ ...blade, position: [x + aside, y, z + 12] }]));"
        "    await new Promise((done) => setTimeout(done, 30));"
        "  }"
        "  window.cut = true;"
        "})()"
    )
    browser.wait("window.cut && organ.frame.surgery.areaMm2 > 30 && organ.geometry.groups[1].count > 0")
    assert browser.run(f"return organ.{place}.length === organ.frame.displacement.length")
    browser.screenshot(str(PICTURES / "example-cut.png"))


def the_react_example_moves(browser: Browser, address: str) -> None:
    """examples/web/react, built by run.sh: the organ follows the pointer through React three fiber."""
    there = Path(sys.argv[1]) / "react"
    shutil.rmtree(there, ignore_errors=True)
    built = Path(os.environ["UPT_REACT"])
    shutil.copytree(built / "dist", there / "dist")
    shutil.copytree(built / "node_modules/libupt", there / "node_modules/libupt")
    shutil.copy(built / "index.html", there)
    shutil.copytree(ROOT / "onnx/liver-coarse", there / "bundles/liver")
    browser.open(f"{address}react/index.html")
    browser.wait("window.organ && organ.geometry.boundingSphere !== undefined")
    browser.run("organ.update([]).then(() => { window.begun = true; })")
    browser.wait("window.begun")
    width, height = browser.run("return [innerWidth, innerHeight]")
    x, y = width // 2, height // 2
    for _ in range(20):
        browser.move([(x - 20, y), (x, y), (x + 10, y + 5)])
        if browser.run("return tools.current.length") == 1:
            break
    browser.wait("organ.frame?.readings[0]?.contact_count > 0 && Math.max(...organ.frame.displacement) > 0.5")
    browser.screenshot(str(PICTURES / "react.png"))


def on(browser: Browser, test: Callable, *arguments: str) -> tuple[str, Callable]:
    return f"{test.__name__} ({', '.join([browser.pointer, *arguments[1:]])})", partial(test, browser, *arguments)


def main() -> int:
    PICTURES.mkdir(parents=True, exist_ok=True)
    server, address = serve(sys.argv[1])
    try:
        desk, phone = Browser(), Browser(390, 844, phone=True)
    except FileNotFoundError as missing:
        print(f"skipped: the page: {missing}\n0 passed, 0 failed, 1 skipped")
        return 0
    runs = [
        on(desk, little_is_loaded, address),
        on(desk, what_has_come_is_kept, address),
        on(desk, errors_are_told, address),
        on(desk, frames_are_shared_where_the_page_is_isolated, address),
        on(desk, a_drag_presses, address, "liver"),
        on(desk, a_recording_comes_again, address, "liver"),
        on(desk, a_grasp_pulls, address, "liver"),
        on(desk, a_cut_is_made_and_undone, address, "liver"),
        on(desk, the_example_moves, address),
        on(phone, a_drag_presses, address, "phone"),
    ]
    if os.environ.get("UPT_REACT"):
        runs.append(on(desk, the_react_example_moves, address))
    passed = failed = 0
    try:
        for name, test in runs:
            try:
                test()
                passed += 1
                print(f"passed: {name}")
            except Exception:
                failed += 1
                print(f"FAILED: {name}\n{traceback.format_exc()}")
    finally:
        desk.close()
        phone.close()
        server.shutdown()
    print(f"{passed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
