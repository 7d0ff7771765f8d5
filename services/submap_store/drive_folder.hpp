// The store's files: one for each drive, numbered.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "common/map_file/drive_file.hpp"
#include "services/submap_store/parameters.hpp"

namespace understory::submap_store {

/// A folder of files drive-0001.gpkg, drive-0002.gpkg and so on, of which the last one may be open.
/// Everything throws map_file::MapFileError, whose one line names the file.
class DriveFolder {
 public:
  /// In a folder that is made where it is not there.
  DriveFolder(std::filesystem::path folder, const FolderParameters& parameters);
  /// In a folder of its own that is gone with this: for replay and experiments. Throws
  /// std::runtime_error where none can be made.
  explicit DriveFolder(const FolderParameters& parameters);
  ~DriveFolder();
  DriveFolder(const DriveFolder&) = delete;
  DriveFolder& operator=(const DriveFolder&) = delete;

  /// The file of the drive that a message with this stamp is of. Where none is open: the one that
  /// was, or the folder's last one, where its drive may go on; else a new one.
  map_file::DriveFile& at(model::Utime utime);
  /// The file that is open; null where none is.
  map_file::DriveFile* current() { return file_.get(); }
  /// Ends the drive of the file as finish() does; the next at() makes another one.
  void begin_drive();
  /// Something is wrong with the file: closes it; the next at() opens it anew.
  void close() { file_.reset(); }
  /// Seals the file, as far as that takes no longer than the parameters allow, and closes it. Never
  /// throws: what is left is done by who opens the file next. False where something is left.
  bool finish() noexcept;

 private:
  bool may_go_on_at(model::Utime utime) const;
  std::filesystem::path name_of(int number) const;
  int last_number() const;

  std::filesystem::path folder_;
  FolderParameters parameters_;
  bool is_temporary_ = false;
  std::optional<int> number_;  ///< Of this drive's file.
  std::unique_ptr<map_file::DriveFile> file_;
};

}  // namespace understory::submap_store
