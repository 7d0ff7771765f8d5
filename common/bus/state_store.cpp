#include "common/bus/state_store.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/bus/state_format.hpp"

namespace understory::bus {
namespace {

namespace fs = std::filesystem;

/// A link in place of a state file could lead to any file.
constexpr int kOwn = O_NOFOLLOW | O_CLOEXEC;

/// After this many failed recoveries the journal is left out; after further ones the snapshot.
constexpr int kAttemptsWithJournal = 2;
constexpr int kAttemptsWithSnapshot = 4;

/// None where the file is not readable or is a symbolic link: state is never read or written
/// through a link.
std::optional<std::string> read_file(const fs::path& file) {
  const int in = ::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (in < 0) return std::nullopt;
  std::string text;
  std::array<char, 65536> bytes{};
  ssize_t got = 0;
  while ((got = ::read(in, bytes.data(), bytes.size())) > 0 || (got < 0 && errno == EINTR)) {
    if (got > 0) text.append(bytes.data(), static_cast<std::size_t>(got));
  }
  ::close(in);
  if (got < 0 && text.empty()) return std::nullopt;
  return text;
}

/// The refusal by errno. If the folder is missing, it is created for the next attempt; if that
/// fails, the refusal has that cause.
wire::Refusal not_kept(const fs::path& file) {
  std::error_code why(errno, std::system_category());
  std::error_code not_made;
  if (errno == ENOENT) fs::create_directories(file.parent_path(), not_made);
  if (not_made) why = not_made;
  return {wire::Reason::kStateNotKept, file.string() + ": " + why.message()};
}

bool write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Writes completely or not at all: the name points to the old content until the new content is on
/// the device.
std::optional<wire::Refusal> replace_file(const fs::path& file, std::string_view bytes) {
  const fs::path temporary = file.string() + ".new";
  const int out = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | kOwn, 0644);
  if (out < 0) return not_kept(temporary);
  const bool is_whole = write_all(out, bytes) && ::fdatasync(out) == 0;
  std::optional<wire::Refusal> refusal;
  if (!is_whole) refusal = not_kept(temporary);
  ::close(out);
  if (!refusal && ::rename(temporary.c_str(), file.c_str()) != 0) refusal = not_kept(file);
  if (refusal) ::unlink(temporary.c_str());
  return refusal;
}

}  // namespace

StateStore::StateStore(fs::path directory, std::string name, Saving saving)
    : directory_(std::move(directory)), name_(std::move(name)), saving_(saving) {}

StateStore::~StateStore() {
  if (writing_.valid()) writing_.wait();
  if (journal_ >= 0) ::close(journal_);
  if (lock_ >= 0) ::close(lock_);
}

void StateStore::lock() {
  if (lock_ >= 0) return;
  std::error_code ignored;
  fs::create_directories(directory_, ignored);
  lock_ = ::open(path(".lock").c_str(), O_RDWR | O_CREAT | kOwn, 0644);
  // On a disk that has become read-only, an existing file can still be locked.
  if (lock_ < 0 && errno == EROFS) lock_ = ::open(path(".lock").c_str(), O_RDONLY | kOwn);
  // If no file can be created, no journal can be either; open() reports that.
  if (lock_ < 0) return;
  if (::flock(lock_, LOCK_EX | LOCK_NB) == 0) return;
  ::close(std::exchange(lock_, -1));
  throw std::runtime_error(path(".lock").string() + ": another process keeps its state here");
}

void StateStore::report_links(Recovered& recovered) const {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(directory_, ignored)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(name_ + ".") || !entry.is_symlink(ignored)) continue;
    recovered.problems.push_back({wire::Reason::kStateNotKept,
                                  entry.path().string() + ": is a symbolic link: not followed"});
  }
}

fs::path StateStore::path(const std::string& suffix) const { return directory_ / (name_ + suffix); }

fs::path StateStore::journal_path(std::uint64_t generation) const {
  return path(".journal." + std::to_string(generation));
}

void StateStore::put_aside(const fs::path& file) {
  std::error_code ignored;
  if (fs::exists(file, ignored)) fs::rename(file, file.string() + ".damaged", ignored);
}

std::optional<std::int64_t> StateStore::lost_snapshot_s() const {
  struct stat lost {};
  struct stat newer {};
  if (::stat(path(".snapshot").c_str(), &newer) == 0) return std::nullopt;
  if (::lstat(path(".snapshot.damaged").c_str(), &lost) != 0) return std::nullopt;
  return lost.st_mtim.tv_sec;
}

void StateStore::refuse_what_killed_before(Recovered& recovered) {
  const int attempts = std::atoi(read_file(path(".recovering")).value_or("0").c_str());
  if (attempts >= kAttemptsWithSnapshot) {
    put_aside(path(".snapshot"));
    recovered.problems.push_back(
        {wire::Reason::kSnapshotDamaged, path(".snapshot").string() + ": recovery with it died " +
                                             std::to_string(attempts) + " times, put aside"});
  }

  if (attempts >= kAttemptsWithJournal) {
    for (const std::uint64_t number : journals()) put_aside(journal_path(number));
    recovered.problems.push_back(
        {wire::Reason::kJournalDamaged, directory_.string() + ": recovery with the journal died " +
                                            std::to_string(attempts) + " times, put aside"});
  }

  replace_file(path(".recovering"), std::to_string(attempts + 1));
}

StateStore::Recovered StateStore::open() {
  Recovered recovered;
  lock();
  report_links(recovered);
  refuse_what_killed_before(recovered);
  bool snapshot_is_lost = false;

  if (const auto bytes = read_file(path(".snapshot"))) {
    auto snapshot = decode_snapshot(*bytes);
    if (snapshot) {
      generation_ = snapshot->generation;
      recovered.snapshot = std::move(snapshot->state);
    } else {
      snapshot_is_lost = true;
      recovered.problems.push_back(
          {snapshot.refusal().reason,
           path(".snapshot").string() + ": " + snapshot.refusal().detail + "; starting fresh"});
      put_aside(path(".snapshot"));
    }
  }

  // Events after a lost snapshot are useless without it; only journal 0 starts from an empty state.
  const std::uint64_t first = generation_;
  const std::uint64_t valid_bytes = snapshot_is_lost ? 0 : take_journals(recovered);
  newest_ = generation_;
  keep_journals(first, generation_);
  if (auto refusal = open_journal(valid_bytes)) recovered.problems.push_back(*refusal);
  return recovered;
}

/// Reads journal generation_ and those that follow without a missing number. Sets generation_ to
/// the last one and returns its readable length [bytes].
std::uint64_t StateStore::take_journals(Recovered& recovered) {
  std::uint64_t valid_bytes = 0;
  for (std::uint64_t number = generation_;; ++number) {
    const auto journal = read_file(journal_path(number));
    if (!journal) return valid_bytes;
    JournalContent content = decode_journal(*journal);
    generation_ = number;
    valid_bytes = content.valid_bytes;
    std::ranges::move(content.events, std::back_inserter(recovered.events));
    if (content.is_damaged) {
      recovered.problems.push_back(
          {wire::Reason::kJournalDamaged, journal_path(number).string() + ": damaged behind byte " +
                                              std::to_string(valid_bytes) + "; going on with the " +
                                              std::to_string(recovered.events.size()) +
                                              " events before"});
    }
    if (content.is_damaged || content.is_torn) return valid_bytes;
  }
}

std::optional<wire::Refusal> StateStore::open_journal(std::uint64_t valid_bytes) {
  if (journal_ >= 0) ::close(journal_);
  const fs::path file = journal_path(generation_);
  journal_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | kOwn, 0644);
  journal_bytes_ = valid_bytes;
  journal_broken_ = journal_ < 0 || ::ftruncate(journal_, static_cast<off_t>(valid_bytes)) != 0;
  if (journal_broken_) return not_kept(file);
  return std::nullopt;
}

/// Numbers of the existing journals.
std::vector<std::uint64_t> StateStore::journals() const {
  const std::string begin = name_ + ".journal.";
  std::vector<std::uint64_t> numbers;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(directory_, ignored)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(begin)) continue;
    const char* const end = file.data() + file.size();
    std::uint64_t number = 0;
    const auto read = std::from_chars(file.data() + begin.size(), end, number);
    if (read.ec == std::errc() && read.ptr == end) numbers.push_back(number);
  }
  return numbers;
}

void StateStore::keep_journals(std::uint64_t first, std::uint64_t last) const {
  std::error_code ignored;
  for (const std::uint64_t number : journals())
    if (number < first || number > last) fs::remove(journal_path(number), ignored);
}

void StateStore::end_recovery() { ::unlink(path(".recovering").c_str()); }

void StateStore::start_over() {
  lock();
  put_aside(path(".snapshot"));
  for (const std::uint64_t number : journals()) put_aside(journal_path(number));
  generation_ = newest_ = 0;
  open_journal(0);
}

std::optional<wire::Refusal> StateStore::append(std::string_view channel,
                                                std::span<const std::uint8_t> bytes) {
  if (journal_broken_) {
    return wire::Refusal{wire::Reason::kStateNotKept,
                         directory_.string() + ": the journal has a hole"};
  }
  const std::string event = encode_event(channel, bytes);
  if (!write_all(journal_, event)) {
    const wire::Refusal refusal = not_kept(journal_path(generation_));
    journal_broken_ = true;
    return refusal;
  }
  journal_bytes_ += event.size();
  return std::nullopt;
}

std::optional<wire::Refusal> StateStore::save(std::string state) {
  lock();  // The directory may be creatable now.
  if (writing_.valid()) ended(writing_.get());

  // Later inputs follow the new snapshot and, until that is on the device, also the previous one.
  // After lost inputs they do not follow the previous one.
  const bool leaves_hole = journal_broken_;
  const std::uint64_t before = std::exchange(generation_, newest_ + (leaves_hole ? 2 : 1));
  newest_ = generation_;
  if (auto refusal = open_journal(0)) {
    ::unlink(journal_path(generation_).c_str());
    generation_ = before;
    return refusal;
  }
  if (is_behind_hole_) ::unlink(journal_path(before).c_str());
  is_behind_hole_ = is_behind_hole_ || leaves_hole;

  if (saving_ == Saving::kAtOnce) return ended(write_snapshot(generation_, state));
  writing_ = std::async(std::launch::async, [this, number = generation_, state = std::move(state)] {
    return write_snapshot(number, state);
  });
  return std::nullopt;
}

/// Reads no member that changes, so it may run in another thread.
StateStore::Kept StateStore::write_snapshot(std::uint64_t generation,
                                            const std::string& state) const {
  if (auto refusal = replace_file(path(".snapshot"), encode_snapshot(generation, state)))
    return refusal;
  keep_journals(generation, std::numeric_limits<std::uint64_t>::max());
  return std::nullopt;
}

StateStore::Kept StateStore::ended(Kept kept) {
  if (!kept) is_behind_hole_ = false;
  return kept;
}

std::optional<StateStore::Kept> StateStore::finished() {
  if (!writing_.valid()) return std::nullopt;
  if (writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  return ended(writing_.get());
}

}  // namespace understory::bus
