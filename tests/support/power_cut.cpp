#include "tests/support/power_cut.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <system_error>

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;

// Taking back is best effort: what a later change has made impossible was lost with it.
void ignore(int /*result*/) {}

std::pair<dev_t, ino_t> identity(int fd) {
  struct stat found {};

  ignore(::fstat(fd, &found));
  return {found.st_dev, found.st_ino};
}

fs::path path_of(int fd) {
  return fs::read_symlink("/proc/self/fd/" + std::to_string(fd));
}

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

off_t size_of(int fd) {
  struct stat found {};

  ignore(::fstat(fd, &found));
  return found.st_size;
}

/// Another descriptor of the same file, whatever it is called by then.
std::shared_ptr<UniqueFd> same_file(int fd) {
  return std::make_shared<UniqueFd>(::open(path_of(fd).c_str(), O_WRONLY | O_CLOEXEC));
}

void restore(int fd, const std::string& bytes) {
  ignore(::ftruncate(fd, 0));
  ignore(static_cast<int>(::pwrite(fd, bytes.data(), bytes.size(), 0)));
}

}  // namespace

PowerCut::Place PowerCut::place_of(const fs::path& path) const {
  const int fd = ::open(path.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  return {std::make_shared<UniqueFd>(fd), path.filename().string()};
}

fs::path PowerCut::keep_aside(const fs::path& path) {
  const fs::path kept = aside_ / std::to_string(++kept_aside_);
  return ::link(path.c_str(), kept.c_str()) == 0 ? kept : fs::path();
}

void PowerCut::add(int fd, std::function<void()> take_back) {
  unsafe_.push_back({identity(fd), std::move(take_back)});
}

void PowerCut::before_open_for_writing(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error)) {
    return;  // emptying an old file is seen by nobody: ours are written under new names
  }
  const Place place = place_of(path);
  add(place.folder->get(),
      [place] { ignore(::unlinkat(place.folder->get(), place.name.c_str(), 0)); });
}

void PowerCut::before_write(int fd) {
  add(fd, [file = same_file(fd), size = size_of(fd)] { ignore(::ftruncate(file->get(), size)); });
}

void PowerCut::before_truncate(int fd) {
  add(fd, [file = same_file(fd), bytes = bytes_of(path_of(fd))] { restore(file->get(), bytes); });
}

void PowerCut::before_rename(const fs::path& from, const fs::path& to) {
  const Place old_place = place_of(from);
  const Place new_place = place_of(to);
  const fs::path replaced = keep_aside(to);
  add(new_place.folder->get(), [old_place, new_place, replaced] {
    ignore(::renameat(new_place.folder->get(),
                      new_place.name.c_str(),
                      old_place.folder->get(),
                      old_place.name.c_str()));
    if (!replaced.empty()) {
      ignore(
          ::renameat(AT_FDCWD, replaced.c_str(), new_place.folder->get(), new_place.name.c_str()));
    }
  });
}

void PowerCut::before_exchange(const fs::path& a, const fs::path& b) {
  const Place first = place_of(a);
  const Place second = place_of(b);
  add(second.folder->get(), [first, second] {
    ignore(::renameat2(first.folder->get(),
                       first.name.c_str(),
                       second.folder->get(),
                       second.name.c_str(),
                       RENAME_EXCHANGE));
  });
}

void PowerCut::before_remove(const fs::path& path) {
  const Place place = place_of(path);
  const fs::path kept = keep_aside(path);
  add(place.folder->get(), [place, kept] {
    if (kept.empty()) {
      ignore(::mkdirat(place.folder->get(), place.name.c_str(), 0777));
    } else {
      ignore(::renameat(AT_FDCWD, kept.c_str(), place.folder->get(), place.name.c_str()));
    }
  });
}

void PowerCut::before_make_folder(const fs::path& path) {
  const Place place = place_of(path);
  add(place.folder->get(), [place] {
    std::error_code ignored;
    fs::remove_all(path_of(place.folder->get()) / place.name, ignored);
  });
}

void PowerCut::after_sync(int fd) {
  std::erase_if(unsafe_, [&](const Change& change) { return change.made_safe_by == identity(fd); });
}

void PowerCut::lose_everything() {
  std::for_each(unsafe_.rbegin(), unsafe_.rend(), [](const Change& change) { change.take_back(); });
  unsafe_.clear();
}

void PowerCut::lose_some(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::for_each(unsafe_.rbegin(), unsafe_.rend(), [&](const Change& change) {
    if ((random() & 1U) == 0U) {
      change.take_back();
    }
  });
  unsafe_.clear();
}

}  // namespace trigmesh::test_support
