# Runs the simulator under a virtual display before and during a press and compares the pictures.
#   simulator.sh SIMULATOR COMPARE BUNDLE FOLDER
set -eu
rm -f "$4/rest.png" "$4/pressed.png"
for picture in rest:6 pressed:75; do
  xvfb-run -a -s "-screen 0 1280x800x24" "$1" "$3" --headless --size 960x600 \
    --frames "${picture#*:}" --screenshot "$4/${picture%:*}.png"
done
"$2" "$4/rest.png" "$4/pressed.png"
# An organ that breathes is elsewhere.
xvfb-run -a -s "-screen 0 1280x800x24" "$1" "$3" --headless --breathe --size 960x600 --frames 75 --screenshot "$4/breathing.png"
if cmp -s "$4/pressed.png" "$4/breathing.png"; then
  echo "the organ does not breathe" >&2
  exit 1
fi
