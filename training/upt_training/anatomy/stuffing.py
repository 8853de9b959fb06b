"""proto"""
import subprocess, numpy as np
def stuff(grid, spacing, sign):
    with open('/tmp/_in.bin','wb') as f:
        f.write(np.asarray(grid.origin,'<f8').tobytes()); f.write(np.asarray([1.0],'<f8').tobytes()); f.write(np.asarray(grid.values.shape,'<u8').tobytes()); f.write(np.ascontiguousarray(grid.values,'<f4').tobytes())
    subprocess.run(['/work/targets/mesh-proto/target/release/mesh-proto','/tmp/_in.bin','/tmp/_out.bin',repr(float(spacing)),repr(sign)],check=True)
    b=open('/tmp/_out.bin','rb').read(); k,t=np.frombuffer(b,'<u8',2)
    p=np.frombuffer(b,'<f8',int(3*k),16).reshape(-1,3).copy(); return p, np.frombuffer(b,'<u4',int(4*t),16+24*int(k)).reshape(-1,4).astype(np.int64)
