#include "common/io/recording_folder.hpp"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>

#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

namespace fs = std::filesystem;

bool same_name(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char left, unsigned char right) {
    return std::tolower(left) == std::tolower(right);
  });
}

std::string_view last_part(std::string_view path) {
  const auto slash = path.find_last_of('/');
  return slash == std::string_view::npos ? path : path.substr(slash + 1);
}

struct ZipCloser {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using ZipArchive = std::unique_ptr<zip_t, ZipCloser>;
using ZipFile = std::unique_ptr<zip_file_t, ZipCloser>;

ZipArchive open_archive(const fs::path& path) {
  int code = 0;
  ZipArchive archive(zip_open(path.c_str(), ZIP_RDONLY, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    throw DataError(
        fmt::format("{}: neither a folder nor a zip archive: {}", path.string(), reason));
  }
  return archive;
}

std::optional<zip_uint64_t> find_entry(zip_t* archive, std::string_view name) {
  const zip_int64_t count = zip_get_num_entries(archive, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* entry = zip_get_name(archive, index, 0);
    if (entry != nullptr && same_name(last_part(entry), name)) return index;
  }
  return std::nullopt;
}

void check_size(std::uint64_t bytes, const std::string& what) {
  if (bytes > RecordingFolder::kMaxFileBytes) {
    throw DataError(fmt::format("{}: {} bytes, more than the {} that are read", what, bytes,
                                RecordingFolder::kMaxFileBytes));
  }
}

std::string read_entry(const fs::path& path, std::string_view name, const std::string& what) {
  const ZipArchive archive = open_archive(path);
  const auto index = find_entry(archive.get(), name);
  if (!index) throw DataError(fmt::format("{}: no such file in the archive", what));

  zip_stat_t status;
  if (zip_stat_index(archive.get(), *index, 0, &status) != 0 ||
      (status.valid & ZIP_STAT_SIZE) == 0) {
    throw DataError(fmt::format("{}: damaged archive: {}", what, zip_strerror(archive.get())));
  }

  check_size(status.size, what);
  const ZipFile file(zip_fopen_index(archive.get(), *index, 0));
  if (!file)
    throw DataError(fmt::format("{}: cannot be unpacked: {}", what, zip_strerror(archive.get())));

  std::string content(status.size, '\0');

  // zip_fread checks the checksum at the end of the entry.
  const zip_int64_t got = zip_fread(file.get(), content.data(), content.size());
  char beyond = 0;
  if (got != static_cast<zip_int64_t>(content.size()) || zip_fread(file.get(), &beyond, 1) != 0) {
    throw DataError(fmt::format("{}: damaged: {}", what, zip_file_strerror(file.get())));
  }

  return content;
}

fs::path find_file(const fs::path& folder, std::string_view name) {
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    if (same_name(entry.path().filename().string(), name)) return entry.path();
  }
  return {};
}

std::string read_file(const fs::path& folder, std::string_view name, const std::string& what) {
  const fs::path path = find_file(folder, name);
  if (path.empty()) throw DataError(fmt::format("{}: no such file", what));
  std::error_code failed;
  const auto bytes = fs::file_size(path, failed);
  std::ifstream file(path, std::ios::binary);
  if (failed || !file) throw DataError(fmt::format("{}: cannot be opened", what));
  check_size(bytes, what);
  std::string content(bytes, '\0');
  if (!file.read(content.data(), static_cast<std::streamsize>(bytes))) {
    throw DataError(fmt::format("{}: cannot be read", what));
  }
  return content;
}

}  // namespace

RecordingFolder::RecordingFolder(fs::path path) : path_(std::move(path)) {
  std::error_code failed;
  if (!fs::exists(path_, failed))
    throw DataError(fmt::format("{}: does not exist", path_.string()));
  is_archive_ = !fs::is_directory(path_, failed);
  if (is_archive_) open_archive(path_);
}

std::string RecordingFolder::read(std::string_view name) const {
  return is_archive_ ? read_entry(path_, name, describe(name))
                     : read_file(path_, name, describe(name));
}

std::string RecordingFolder::describe(std::string_view name) const {
  return is_archive_ ? fmt::format("{}:{}", path_.string(), name)
                     : (path_ / std::string(name)).string();
}

}  // namespace understory::io
