// To the server of `upt view`; what the two say to each other is in protocol.rs. The page of `cargo xtask site` has another file of this name,
// which asks a worker of its own.
export function connect({ hello, geometry, frame, surface, refused, tell }) {
  const socket = new WebSocket(`ws://${location.host}/socket${location.search}`);
  socket.binaryType = "arraybuffer";
  let built = false;
  let changed; // what the next message has the numbers of
  const text = (said) => {
    if (said.surface) changed = said.surface;
    else if (said.refused) refused(said.refused);
    else hello(said);
  };
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") {
      text(JSON.parse(data));
      return;
    }
    if (changed) surface(changed, data);
    else if (built) frame(data);
    else geometry(data);
    changed = undefined;
    built = true;
  };
  socket.onclose = ({ reason }) => tell(reason || "The connection is closed: run upt view again, or close its other page.");
  return (message) => {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
}
