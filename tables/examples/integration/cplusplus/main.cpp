// The guarded approach in C++: two arms, each with a state of its own, and a state that is kept in a file.
//
// The generated C is compiled as C; its header may be included from C++11 on. What a wrapper adds is little: a constructor that
// begins, and a snapshot that says by itself whether it may be gone on from.
#include <cstdio>
#include <fstream>

#include "approach.h"

class Approach {
public:
    Approach() { approach_init(&state_); }

    // One cycle; false where it ended in a fault: then the arm is told to stand.
    bool step(std::uint16_t distance_mm, double force_n)
    {
        state_.distance_mm = distance_mm;
        state_.braking_mm = 250;
        state_.force_n = force_n;
        const bool good = approach_approach_step(&state_) == APPROACH_FAULT_NONE;
        if (!good) {
            state_.speed_mm_s = 0;
        }
        return good;
    }

    std::uint16_t speed_mm_s() const { return state_.speed_mm_s; }
    std::int32_t line() const { return state_.line; }

    void save(const char *path) const
    {
        std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char *>(&state_), sizeof state_);
    }

    // Goes on from a file; false, and nothing changes, where it is of other tables or no state at all.
    bool load(const char *path)
    {
        approach_t kept = {};
        std::ifstream file(path, std::ios::binary);
        file.read(reinterpret_cast<char *>(&kept), sizeof kept);
        const bool whole = file.gcount() == static_cast<std::streamsize>(sizeof kept);
        if (!whole || approach_check(&kept) != APPROACH_CHECK_OK) {
            return false;
        }
        state_ = kept;
        return true;
    }

private:
    approach_t state_;
};

int main(int, char **argv)
{
    Approach left, right;
    const bool good = left.step(2000, 0.5) && right.step(100, 0.5);
    std::printf("left %u mm/s, right %u mm/s\n", unsigned(left.speed_mm_s()), unsigned(right.speed_mm_s()));
    if (!good || left.line() != APPROACH_LINE_APPROACH_CRUISE || right.line() != APPROACH_LINE_APPROACH_BRAKE) {
        return 1;
    }
    if (left.step(2000, 501.0)) { // a force that the tables do not admit
        return 1;
    }
    std::printf("refused, left %u mm/s\n", unsigned(left.speed_mm_s()));
    if (argv[1] == nullptr) {
        return 0;
    }
    right.save(argv[1]);
    Approach later;
    const bool kept = later.load(argv[1]);
    std::printf("%s, right %u mm/s\n", kept ? "kept" : "lost", unsigned(later.speed_mm_s()));
    std::fstream(argv[1], std::ios::in | std::ios::out | std::ios::binary).put('?'); // as another version of the tables would
    std::printf("%s\n", later.load(argv[1]) ? "misread" : "another version's: refused");
    return 0;
}
