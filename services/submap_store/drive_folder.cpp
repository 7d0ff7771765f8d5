#include "services/submap_store/drive_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace understory::submap_store {
namespace {

namespace fs = std::filesystem;
using map_file::DriveFile;
using map_file::Fault;
using map_file::MapFileError;
using Clock = std::chrono::steady_clock;

/// Largest disorder of stamps of two messages of one drive [us].
constexpr model::Utime kDisorder_us = 1'000'000;
/// Submaps processed between two checks of the time.
constexpr std::size_t kDrawnTogether = 20;

constexpr const char* kSetAside = ".set-aside";

/// Number in the name of a drive's file, also of a renamed one: numbers are never reused. 0 for
/// other files.
int number_in(const fs::path& file) {
  int number = 0;
  int end = 0;
  const std::string name = file.filename().string();
  if (std::sscanf(name.c_str(), "drive-%8d.gpkg%n", &number, &end) != 1 || end == 0) return 0;
  const std::string_view rest = std::string_view(name).substr(static_cast<std::size_t>(end));
  return rest.empty() || rest.starts_with(kSetAside) ? std::max(number, 0) : 0;
}

/// Whether a fault makes a drive continue in another file. A file that is open elsewhere, or
/// without space on its device, may be usable a second later.
bool is_passed_over(Fault fault) {
  return fault != Fault::kInUse && fault != Fault::kFull && fault != Fault::kRefused;
}

/// A foreign map keeps its name.
bool is_set_aside(Fault fault) { return fault == Fault::kDamaged || fault == Fault::kForeign; }

/// Renames the file and its SQLite side files, the file itself last. Returns the new name; the old
/// one if renaming fails.
fs::path set_aside(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return file;
  fs::path aside = file.string() + kSetAside;
  for (int i = 2; fs::exists(fs::symlink_status(aside, error)); ++i)
    aside = fmt::format("{}{}-{}", file.string(), kSetAside, i);
  for (const char* const suffix : {"-wal", "-journal"})
    fs::rename(file.string() + suffix, aside.string() + suffix, error);
  fs::rename(file, aside, error);
  return error ? file : aside;
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
    throw MapFileError(Fault::kUnreadable,
                       fmt::format("{}: cannot be read: {}", folder_.string(), error.message()));
  return last;
}

DriveFile& DriveFolder::at(model::Utime utime) {
  if (file_) {
    try {
      file_->require_in_place();
      return *file_;
    } catch (const MapFileError& fault) {
      give_up(fault);
    }
  }
  make_folder();
  if (!open_last(utime)) make_next();
  return *file_;
}

void DriveFolder::make_folder() const {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error)
    throw MapFileError(Fault::kReadOnly,
                       fmt::format("{}: cannot be made: {}", folder_.string(), error.message()));
}

/// Opens this drive's file, or the folder's last one if permitted; else false. If it must be
/// skipped, the next file is opened instead.
bool DriveFolder::open_last(model::Utime utime) {
  const bool is_same_drive = number_.has_value();
  const int last = is_same_drive ? *number_ : last_number();
  if (given_up_) {
    pass_over(last, MapFileError(*given_up_));
    return true;
  }
  std::error_code ignored;
  const bool is_there = last > 0 && fs::exists(fs::symlink_status(name_of(last), ignored));
  if (!is_there) return false;

  try {
    file_ = std::make_unique<DriveFile>(name_of(last), !is_temporary_);
    if (!is_same_drive && !may_go_on_at(utime)) begin_drive();
  } catch (const MapFileError& fault) {
    file_.reset();
    if (!is_passed_over(fault.fault())) throw;
    pass_over(last, fault);
  }
  if (file_) number_ = number_in(file_->file());
  return file_ != nullptr;
}

void DriveFolder::make_next() {
  const int number = number_ ? *number_ : last_number() + 1;
  DriveFile::make(name_of(number));
  file_ = std::make_unique<DriveFile>(name_of(number), !is_temporary_);
  number_ = number;
}

/// Skips a file only after another one exists: if the whole device fails, this fails too, and the
/// drive continues in its file as soon as possible.
void DriveFolder::pass_over(int number, const MapFileError& fault) {
  const auto own_number = std::exchange(number_, std::nullopt);
  try {
    make_next();
  } catch (const MapFileError&) {
    number_ = own_number;
    throw MapFileError(fault);
  }
  given_up_.reset();

  const fs::path file = name_of(number);
  const fs::path aside = is_set_aside(fault.fault()) ? set_aside(file) : file;
  if (own_number) earlier_.push_back(aside);
  passed_over_.push_back(
      {fault.fault(),
       fmt::format("{}; {}the drive goes on in {}", fault.what(),
                   aside == file ? "" : fmt::format("it is {} now, ", aside.filename().string()),
                   file_->file().filename().string())});
}

void DriveFolder::give_up(const MapFileError& fault) {
  file_.reset();
  given_up_ = fault;
}

std::optional<model::Submap> DriveFolder::find_passed_over(const map_file::SubmapKey& key) const {
  for (const fs::path& file : earlier_) {
    try {
      if (auto found = map_file::submap_in(file, key)) return found;
    } catch (const MapFileError&) {
      // Its fault was reported when it was skipped.
    }
  }
  return std::nullopt;
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
  given_up_.reset();
  earlier_.clear();
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
    // For example a full disk: the open file stays open.
  }
  file_.reset();
  return is_sealed;
}

}  // namespace understory::submap_store
