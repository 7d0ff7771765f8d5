// Reuse of a process's freed memory.
#pragma once

namespace understory::bus {

/// Keeps freed blocks of up to 64 MiB instead of giving them back to the kernel: buffers of sweeps
/// are allocated and freed ten times a second, and page faults of new ones would double the cost.
/// Call it once, at the start of main().
void keep_freed_memory();

}  // namespace understory::bus
