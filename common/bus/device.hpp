// A device beside the bus (a sensor's socket, a serial line) that a process reads itself.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace understory::bus {

/// Folder in a process's state directory with what people keep, which no program deletes with the
/// state.
inline constexpr const char* kKeptFolder = "maps";

/// An adapter that is a Device too is opened and attended by run_service, in the one thread that
/// also handles the bus: no lock, no queue between threads. Replay and experiments host adapters
/// without opening them.
class Device {
 public:
  virtual ~Device() = default;
  /// Before open(), where the process keeps its state in a directory: what the device writes may be
  /// there, too.
  virtual void set_state_directory(const std::filesystem::path& /*directory*/) {}
  /// Before the process connects to the bus. Throws where the device cannot be opened; what()
  /// names it.
  virtual void open() = 0;
  /// Each is readable when there is something to take in; they stay the same after open().
  virtual std::vector<int> file_descriptors() const = 0;
  /// Takes in what has come and publishes. Short: it holds up everything else of the process.
  virtual void attend(std::int64_t monotonic_us) = 0;
  /// The longest wait until the next attend() where nothing comes [ms].
  virtual int wait_ms() const = 0;
};

}  // namespace understory::bus
