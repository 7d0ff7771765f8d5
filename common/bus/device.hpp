// A device beside the bus (a sensor's socket, a serial line) that a process reads by itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace understory::bus {

/// Folder in a process's state directory for files that people keep; no program deletes it with the
/// state.
inline constexpr const char* kKeptFolder = "maps";

/// An adapter that is a Device too is opened and attended by run_service, in the one thread that
/// also handles the bus: no lock, no queue between threads. Replay and experiments host adapters
/// without opening them.
class Device {
 public:
  virtual ~Device() = default;
  /// Called before open() if the process has a state directory: the device may write its files
  /// there.
  virtual void set_state_directory(const std::filesystem::path& /*directory*/) {}
  /// Called before the process connects to the bus. Throws where the device cannot be opened;
  /// what() names it.
  virtual void open() = 0;
  /// Descriptors that are readable when input waits; constant after open().
  virtual std::vector<int> file_descriptors() const = 0;
  /// Reads the waiting input and publishes. It must be short: it blocks the rest of the process.
  virtual void attend(std::int64_t monotonic_us) = 0;
  /// The longest time until the next attend() without input [ms].
  virtual int wait_ms() const = 0;
};

}  // namespace understory::bus
