// Errors of map files.
#pragma once

#include <stdexcept>
#include <string>

namespace understory::map_file {

/// The reason why a map file was not opened, read or written.
enum class Fault {
  kUnreadable,    ///< It is missing, not a regular file, or the device failed.
  kForeign,       ///< It is not a GeoPackage, or not one of ours.
  kOtherVersion,  ///< Its schema is older or newer than the supported ones.
  kInUse,         ///< Another process has it open.
  kReadOnly,      ///< It cannot be changed.
  kFull,          ///< There is no room on the device. Nothing was changed.
  kDamaged,       ///< Its content differs from the written content.
  kUntrusted,     ///< A change would run foreign SQL in the file. Nothing was changed.
  kRefused,  ///< The request is invalid: a missing map or change, or an impossible value. Nothing
             ///< was changed.
};

/// An error of a map file; what() is one line with the file name.
class MapFileError : public std::runtime_error {
 public:
  /// Takes the kind of fault and the line for what().
  MapFileError(Fault fault, const std::string& line) : std::runtime_error(line), fault_(fault) {}
  /// The kind of fault.
  Fault fault() const { return fault_; }

 private:
  Fault fault_;
};

}  // namespace understory::map_file
