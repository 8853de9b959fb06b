# Runs the simulator under a virtual display before and during a press, with tools that change the
# body and with an organ that breathes, and compares the pictures.
#   simulator.sh SIMULATOR COMPARE BUNDLE FOLDER
set -eu
program=$1 compare=$2 bundle=$3 folder=$4
show() { # NAME FRAMES OPTION...
  name=$1 frames=$2
  shift 2
  rm -f "$folder/$name.png"
  xvfb-run -a -s "-screen 0 1280x800x24" "$program" "$bundle" --headless "$@" --size 960x600 \
    --frames "$frames" --screenshot "$folder/$name.png"
}
show rest 6
show pressed 75
# Before the spatula presses the lip.
show operated 168 --operate | tee "$folder/operated.txt"
if ! grep -Eq '^cut [1-9][0-9]+ mm2, taken [1-9][0-9]+ mm3, hardened [1-9]' "$folder/operated.txt"; then
  echo "a tool has changed nothing" >&2
  exit 1
fi
"$compare" "$folder/rest.png" "$folder/pressed.png" "$folder/operated.png"
# An organ that breathes is elsewhere.
show breathing 75 --breathe
if cmp -s "$folder/pressed.png" "$folder/breathing.png"; then
  echo "the organ does not breathe" >&2
  exit 1
fi
