# Runs the simulator under a virtual display before and during a press, with tools that change the
# body, with an organ that breathes and with a gall bladder that is drawn off, and compares the
# pictures.
#   simulator.sh SIMULATOR COMPARE BRAIN FOLDER LIVER
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
bundle=$5
# While it is drawn off its bed peels, and after that none of it is left.
for frames in 88 130; do
  show drawn-$frames $frames --hang --breathe | tee "$folder/drawn-$frames.txt"
done
if ! grep -Eq '^a gall bladder on a bed of 12 ties: ([1-9]|10|11) torn, the others pull with [1-9]' "$folder/drawn-88.txt" ||
  ! grep -q '^a gall bladder on a bed of 12 ties: 12 torn' "$folder/drawn-130.txt"; then
  echo "the bed of the gall bladder does not peel" >&2
  exit 1
fi
