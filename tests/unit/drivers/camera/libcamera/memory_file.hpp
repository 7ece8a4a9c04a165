#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <sys/mman.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "firmware/base/unique_fd.hpp"

namespace trigmesh::test_support {

/// Stands for the memory of a device: a descriptor that can be mapped, with bytes in it.
class MemoryFile {
 public:
  explicit MemoryFile(const std::vector<std::uint8_t>& bytes)
      : fd_(::memfd_create("frame", MFD_CLOEXEC)) {
    EXPECT_EQ(::write(fd_.get(), bytes.data(), bytes.size()), std::ssize(bytes));
  }

  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  UniqueFd fd_;
};

}  // namespace trigmesh::test_support
