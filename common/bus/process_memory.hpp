// How a process treats the memory that it has used.
#pragma once

namespace understory::bus {

/// Keeps freed blocks of up to 64 MiB instead of giving them back to the kernel: a sweep's buffers
/// come and go ten times a second, and the page faults of new ones cost as much as the work on
/// them. To be called once, at the start of main().
void keep_freed_memory();

}  // namespace understory::bus
