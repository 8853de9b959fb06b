"""wheel_calls.py WHEEL_FOLDER DLL_EXPORTS: the dll exports each function that the package calls."""

import re
import sys
from pathlib import Path

called = set(re.findall(r'^ +"(upt_[a-z_]+)": \(', (Path(sys.argv[1]) / "upt/_native.py").read_text(), re.M))
exported = set(Path(sys.argv[2]).read_text().split())
print(f"  {len(called)} functions")
sys.exit(f"not exported: {sorted(called - exported)}" if not called or called - exported else 0)
