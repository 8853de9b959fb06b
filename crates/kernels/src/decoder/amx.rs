//! The decoder's products on matrix tiles (Intel AMX, `tdpbf16ps`): operands rounded to bf16, sums in f32, as [`super::bf16`]
//! does with vectors, at about eight times its rate. Linux on CPUs with AMX-BF16; the system is asked once for leave.
//!
//! `y [16 outputs][48 nodes] += W [16][32] x [32][48]`: one tile of weights, three of nodes, three of sums. The compiler has no
//! registers of this kind, so the products are written in assembly and keep nothing in tiles between two calls.

use std::sync::OnceLock;

/// Nodes that a bf16 product takes at once, on matrix tiles or vectors.
pub(super) const NODES: usize = 48;
/// Outputs of a tile.
pub(super) const OUTPUTS: usize = 16;
/// Depth of a tile.
pub(super) const DEPTH: usize = 32;

/// Whether this process may multiply on tiles. The first call asks the system, which from then on wants larger signal stacks of the
/// host: only a scene that asks for bf16 gets here.
pub(super) fn is_available() -> bool {
    static ALLOWED: OnceLock<bool> = OnceLock::new();
    *ALLOWED.get_or_init(allowed)
}

#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
fn allowed() -> bool {
    /// `arch_prctl`: ask for a feature of the extended state.
    const ARCH_REQ_XCOMP_PERM: libc::c_long = 0x1023;
    /// The tiles' data.
    const XFEATURE_XTILEDATA: libc::c_long = 18;
    if !is_built_in() {
        return false;
    }
    // SAFETY: reads and changes nothing but this process's leave to use the tiles.
    let answer = unsafe {
        libc::syscall(
            libc::SYS_arch_prctl,
            ARCH_REQ_XCOMP_PERM,
            XFEATURE_XTILEDATA,
        )
    };
    answer == 0
}

#[cfg(not(all(target_arch = "x86_64", target_os = "linux")))]
fn allowed() -> bool {
    false
}

/// Whether the CPU has the tiles, and this library a way to them; asks nobody.
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
pub(super) fn is_built_in() -> bool {
    use core::arch::x86_64::{__cpuid, __cpuid_count};
    if __cpuid(0).eax < 7 {
        return false;
    }
    let features = __cpuid_count(7, 0).edx;
    let (bf16, tiles) = (features & 1 << 22 != 0, features & 1 << 24 != 0);
    bf16 && tiles && crate::Isa::has_bf16()
}

#[cfg(not(all(target_arch = "x86_64", target_os = "linux")))]
pub(super) fn is_built_in() -> bool {
    false
}

/// Shapes of the eight tiles: 16 rows of 64 bytes each.
#[repr(C, align(64))]
/// The 64 bytes that `ldtilecfg` reads (Intel SDM, volume 1, "Programming with Intel AMX").
struct Shapes {
    /// 1: eight tiles of up to 16 rows of 64 bytes.
    palette: u8,
    /// Where an interrupted load goes on; 0 of a fresh one.
    start_row: u8,
    /// Must be zeros.
    reserved: [u8; 14],
    /// By tile; the last eight are unused and zero.
    row_bytes: [u16; 16],
    /// By tile likewise.
    rows: [u8; 16],
}

static SHAPES: Shapes = {
    let (mut row_bytes, mut rows) = ([0; 16], [0; 16]);
    let mut tile = 0;
    while tile < 8 {
        row_bytes[tile] = 64;
        rows[tile] = 16;
        tile += 1;
    }
    Shapes {
        palette: 1,
        start_row: 0,
        reserved: [0; 14],
        row_bytes,
        rows,
    }
};

/// Sums of sixteen outputs for a tile of nodes.
#[repr(align(64))]
pub(super) struct Sums(pub(super) [[f32; NODES]; OUTPUTS]);

/// The tiles of this thread, configured until it is dropped.
/// Tiles are state of the thread. It is not kept over a call: a thread with live tiles has eight
/// kilobytes more to save at each switch.
pub(super) struct Tiles(());

impl Tiles {
    /// # Safety
    /// [`is_available`].
    #[cfg(target_arch = "x86_64")]
    pub(super) unsafe fn configure() -> Tiles {
        // SAFETY: the shapes are those of palette 1.
        unsafe {
            core::arch::asm!("ldtilecfg [{}]", in(reg) &raw const SHAPES, options(nostack, readonly));
        }
        Tiles(())
    }

    /// `sums = W x`: `weights [depth/32][16][32]` bf16, `x [depth/2][48][2]` bf16 as pairs, the depth a multiple of 32.
    ///
    /// # Safety
    /// The pointers hold what the shapes say.
    #[cfg(target_arch = "x86_64")]
    pub(super) unsafe fn multiply(
        &self,
        weights: *const half::bf16,
        x: *const u32,
        steps: usize,
        sums: &mut Sums,
    ) {
        // SAFETY: the caller's; the tiles are configured while `self` lives.
        unsafe {
            core::arch::asm!(
                "tilezero tmm0",
                "tilezero tmm1",
                "tilezero tmm2",
                // One tile of weights meets three of nodes in each turn: four loads for three
                // products.
                "2:",
                "tileloadd tmm3, [{w} + {line}]",
                "tileloadd tmm4, [{x} + {row}]",
                "tileloadd tmm5, [{x} + {row} + 64]",
                "tileloadd tmm6, [{x} + {row} + 128]",
                "tdpbf16ps tmm0, tmm3, tmm4",
                "tdpbf16ps tmm1, tmm3, tmm5",
                "tdpbf16ps tmm2, tmm3, tmm6",
                "add {w}, 1024",
                "add {x}, {block}",
                "dec {steps}",
                "jnz 2b",
                "tilestored [{y} + {row}], tmm0",
                "tilestored [{y} + {row} + 64], tmm1",
                "tilestored [{y} + {row} + 128], tmm2",
                w = inout(reg) weights => _,
                x = inout(reg) x => _,
                steps = inout(reg) steps.max(1) => _,
                y = in(reg) sums.0.as_mut_ptr(),
                line = in(reg) 64usize,
                row = in(reg) 4 * NODES,
                block = const 16 * 4 * NODES,
                out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                out("tmm4") _, out("tmm5") _, out("tmm6") _,
                options(nostack),
            );
        }
    }
}

impl Drop for Tiles {
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the tiles were configured on this thread; released, they cost nothing at a change of threads.
        unsafe {
            core::arch::asm!("tilerelease", options(nostack, nomem));
        }
    }
}
