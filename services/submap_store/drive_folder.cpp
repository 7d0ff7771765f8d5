#include "services/submap_store/drive_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace understory::submap_store {
namespace {

namespace fs = std::filesystem;
using map_file::DriveFile;
using Clock = std::chrono::steady_clock;

/// Stamps of two messages of one drive may come so much out of order [us].
constexpr model::Utime kDisorder_us = 1'000'000;
/// Submaps that are drawn between two looks at the clock.
constexpr std::size_t kDrawnTogether = 20;

/// Number in the name of a drive's file; 0 for other files.
int number_in(const fs::path& file) {
  int number = 0;
  int end = 0;
  const std::string name = file.filename().string();
  const bool matches = std::sscanf(name.c_str(), "drive-%d.gpkg%n", &number, &end) == 1 &&
                       static_cast<std::size_t>(end) == name.size();
  return matches ? std::max(number, 0) : 0;
}

fs::path temporary_folder() {
  std::string name = (fs::temp_directory_path() / "understory-maps-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw std::runtime_error("no temporary folder for submaps");
  return name;
}

}  // namespace

DriveFolder::DriveFolder(fs::path folder, const FolderParameters& parameters)
    : folder_(std::move(folder)), parameters_(parameters) {}

DriveFolder::DriveFolder(const FolderParameters& parameters)
    : folder_(temporary_folder()), parameters_(parameters), is_temporary_(true) {}

DriveFolder::~DriveFolder() {
  file_.reset();
  std::error_code ignored;
  if (is_temporary_) fs::remove_all(folder_, ignored);
}

fs::path DriveFolder::name_of(int number) const {
  return folder_ / fmt::format("drive-{:04}.gpkg", number);
}

int DriveFolder::last_number() const {
  int last = 0;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error))
    last = std::max(last, number_in(entry->path()));
  if (error)
    throw map_file::MapFileError(
        map_file::Fault::kUnreadable,
        fmt::format("{}: cannot be read: {}", folder_.string(), error.message()));
  return last;
}

DriveFile& DriveFolder::at(model::Utime utime) {
  if (file_) return *file_;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error)
    throw map_file::MapFileError(
        map_file::Fault::kReadOnly,
        fmt::format("{}: cannot be made: {}", folder_.string(), error.message()));

  const bool is_same_drive = number_.has_value();
  const int last = is_same_drive ? *number_ : last_number();
  if (last > 0 && fs::exists(name_of(last))) {
    file_ = std::make_unique<DriveFile>(name_of(last), !is_temporary_);
    if (!is_same_drive && !may_go_on_at(utime)) begin_drive();
  }
  if (!file_) {
    const int number = is_same_drive ? last : last_number() + 1;
    DriveFile::make(name_of(number));
    file_ = std::make_unique<DriveFile>(name_of(number), !is_temporary_);
    number_ = number;
  }
  number_ = number_in(file_->file());
  return *file_;
}

bool DriveFolder::may_go_on_at(model::Utime utime) const {
  if (!file_->may_go_on()) return false;
  const auto newest = file_->newest();
  if (!newest) return true;
  const auto most = static_cast<model::Utime>(parameters_.go_on_within_s * 1e6);
  return utime >= *newest - kDisorder_us && utime - *newest <= most;
}

void DriveFolder::begin_drive() {
  (void)finish();
  number_ = last_number() + 1;
}

bool DriveFolder::finish() noexcept {
  if (!file_) return true;
  bool is_sealed = is_temporary_;
  try {
    const auto end = Clock::now() +
                     std::chrono::duration<double>(is_temporary_ ? 0.0 : parameters_.seal_within_s);
    bool is_drawn = false;
    while (!is_drawn && Clock::now() < end) is_drawn = file_->draw(kDrawnTogether) == 0;
    const std::chrono::duration<double> needed(static_cast<double>(file_->size()) /
                                               parameters_.rows_sealed_per_s);
    if (is_drawn && Clock::now() + needed < end) {
      file_->seal();
      is_sealed = true;
    }
  } catch (const std::exception&) {
    // A full disk, say: what is open stays open.
  }
  file_.reset();
  return is_sealed;
}

}  // namespace understory::submap_store
