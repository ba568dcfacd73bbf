// A problem of `cgla conform` in C++17 without libraries: its JSON, what a path costs, where it may not go, the answer.
//
// Include this file, write a function from a Map to a path, and answer as dijkstra.cpp does in its last lines; ompl.cpp
// does the same with a library. Docs: docs/conformance.md.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// Closer to an edge than this part of the longer side counts as crossing it: the oracle has no tolerance.
const double NEAR = 1e-9;
// A threat farther away than so many of its spreads is left out of an integral: its risk is below 1e-12.
const double FAR = 7.5;

// ---- as much of JSON as a problem has ----

struct Json {
    double number = 0.0;
    std::string text;
    std::vector<Json> items;
    std::map<std::string, Json> keys;
    const Json& operator[](const std::string& key) const { return keys.at(key); }
    const Json& operator[](size_t i) const { return items.at(i); }
};

struct Reader {
    const char* at;
    void blanks() { while (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t') ++at; }
    bool take(char c) { blanks(); if (*at != c) return false; ++at; return true; }
    std::string string() {
        std::string out;
        if (!take('"')) throw std::runtime_error("a string is missing");
        while (*at && *at != '"') { if (*at == '\\') ++at; out += *at++; }
        ++at;
        return out;
    }
    Json value() {
        Json out;
        blanks();
        if (*at == '"') {
            out.text = string();
        } else if (take('[')) {
            if (take(']')) return out;
            do out.items.push_back(value()); while (take(','));
            if (!take(']')) throw std::runtime_error("a ] is missing");
        } else if (take('{')) {
            if (take('}')) return out;
            do { std::string key = string(); take(':'); out.keys[key] = value(); } while (take(','));
            if (!take('}')) throw std::runtime_error("a } is missing");
        } else if (*at == 'n' || *at == 't') {
            at += 4;
        } else if (*at == 'f') {
            at += 5;
        } else {
            char* end;
            out.number = std::strtod(at, &end);
            if (end == at) throw std::runtime_error("a value is missing");
            at = end;
        }
        return out;
    }
};

// ---- what a path costs, and where it may not go ----

struct Point { double x, y; };
struct Threat { double x, y, spread, peak; };
struct Raster { double x_min, y_min, x_max, y_max; bool nearest; std::vector<std::vector<double>> values; };

inline double between(double low, double x, double high) { return std::min(std::max(x, low), high); }

inline double risk_of(const Raster& raster, Point p) {
    if (p.x < raster.x_min || p.x > raster.x_max || p.y < raster.y_min || p.y > raster.y_max) return 0.0;
    const auto& v = raster.values;  // rows begin at y_min
    const int rows = int(v.size()), columns = int(v[0].size());
    double across = (p.x - raster.x_min) / (raster.x_max - raster.x_min) * columns;
    double up = (p.y - raster.y_min) / (raster.y_max - raster.y_min) * rows;
    if (raster.nearest) return v[std::min(int(up), rows - 1)][std::min(int(across), columns - 1)];
    across = between(0.0, across - 0.5, columns - 1.0);
    up = between(0.0, up - 0.5, rows - 1.0);
    const int i = int(across), j = int(up), right = std::min(i + 1, columns - 1), above = std::min(j + 1, rows - 1);
    const double a = across - i, b = up - j;
    return (v[j][i] * (1 - a) + v[j][right] * a) * (1 - b) + (v[above][i] * (1 - a) + v[above][right] * a) * b;
}

inline double risk_of(const std::vector<Threat>& threats, Point p) {
    double spared = 1.0;
    for (const Threat& t : threats) {
        const double squared = (p.x - t.x) * (p.x - t.x) + (p.y - t.y) * (p.y - t.y);
        spared *= 1.0 - t.peak * std::exp(-squared / (2.0 * t.spread * t.spread));
    }
    return 1.0 - spared;
}

struct Map {
    double x_min, y_min, x_max, y_max, side, k;
    Point start, goal;
    std::vector<Threat> threats;
    std::vector<Raster> rasters;
    // each edge of each ring; holes are rings like any other: what is inside of an odd number of them is closed
    std::vector<std::pair<Point, Point>> edges;

    explicit Map(const Json& problem) {
        const Json& b = problem["bounds"];
        x_min = b[0].number, y_min = b[1].number, x_max = b[2].number, y_max = b[3].number;
        side = std::max(x_max - x_min, y_max - y_min);
        k = problem["k"].number;
        start = {problem["start"][0].number, problem["start"][1].number};
        goal = {problem["goal"][0].number, problem["goal"][1].number};
        for (const Json& t : problem["threats"].items)
            threats.push_back({t["x"].number, t["y"].number, t["spread"].number, t["peak"].number});
        for (const Json& r : problem["rasters"].items) {
            const Json& c = r["bounds"];
            Raster raster{c[0].number, c[1].number, c[2].number, c[3].number, r["interpolation"].text == "nearest", {}};
            for (const Json& row : r["values"].items) {
                raster.values.emplace_back();
                for (const Json& value : row.items) raster.values.back().push_back(value.number);
            }
            rasters.push_back(raster);
        }
        for (const Json& polygon : problem["no_fly"].items)
            for (const Json& ring : polygon.items)
                for (size_t i = 0, n = ring.items.size(); i < n; ++i) {
                    const Json &a = ring[i], &e = ring[(i + 1) % n];
                    edges.push_back({{a[0].number, a[1].number}, {e[0].number, e[1].number}});
                }
    }

    double risk(Point p) const {
        double sum = risk_of(threats, p);
        for (const Raster& raster : rasters) sum += risk_of(raster, p);
        return sum;
    }

    // length + k * risk of a segment, as exact as the oracle to about 1e-9: Gauss's rule on parts no longer than the least
    // spread for threats, and on the part within each cell for rasters, where it is exact
    double cost(Point a, Point b) const {
        const double length = std::hypot(b.x - a.x, b.y - a.y);
        double mean = 0.0;
        for (const Raster& raster : rasters) mean += mean_of(raster, a, b);
        return length * (1.0 + k * (mean + mean_of_threats(a, b, length)));
    }

    double mean_of_threats(Point a, Point b, double length) const {
        static const double AT[] = {0.5, 0.230765344947158, 0.769234655052842, 0.046910077030668, 0.953089922969332};
        static const double WEIGHT[] = {0.284444444444444, 0.239314335249683, 0.239314335249683, 0.118463442528095, 0.118463442528095};
        static thread_local std::vector<Threat> met;
        met.clear();
        double least = HUGE_VAL;
        for (const Threat& t : threats) {
            const double dx = b.x - a.x, dy = b.y - a.y;
            const double at = length > 0.0 ? between(0.0, ((t.x - a.x) * dx + (t.y - a.y) * dy) / (length * length), 1.0) : 0.0;
            if (std::hypot(t.x - a.x - at * dx, t.y - a.y - at * dy) > FAR * t.spread) continue;
            met.push_back(t);
            least = std::min(least, t.spread);
        }
        if (met.empty()) return 0.0;
        const int parts = 1 + int(length / least);
        double sum = 0.0;
        for (int i = 0; i < parts; ++i)
            for (int j = 0; j < 5; ++j) {
                const double at = (i + AT[j]) / parts;
                sum += WEIGHT[j] * risk_of(met, {a.x + at * (b.x - a.x), a.y + at * (b.y - a.y)});
            }
        return sum / parts;
    }

    static double mean_of(const Raster& raster, Point a, Point b) {
        // where the segment enters and leaves cells: those of equal values, or those between the centres
        static thread_local std::vector<double> cuts;
        cuts.assign({0.0, 1.0});
        const double shift = raster.nearest ? 0.0 : 0.5;
        cut(cuts, a.x, b.x, raster.x_min, raster.x_max, int(raster.values[0].size()), shift);
        cut(cuts, a.y, b.y, raster.y_min, raster.y_max, int(raster.values.size()), shift);
        std::sort(cuts.begin(), cuts.end());
        double sum = 0.0;
        for (size_t i = 0; i + 1 < cuts.size(); ++i) {
            const double half = 0.5 * (cuts[i + 1] - cuts[i]), middle = cuts[i] + half;
            if (half <= 0.0) continue;
            auto at = [&](double t) { return risk_of(raster, {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)}); };
            const double off = half * 0.577350269189626;
            sum += raster.nearest ? 2.0 * half * at(middle) : half * (at(middle - off) + at(middle + off));
        }
        return sum;
    }

    static void cut(std::vector<double>& cuts, double a, double b, double low, double high, int cells, double shift) {
        if (a == b) return;
        auto add = [&](double line) {
            const double at = (low + (high - low) * line / cells - a) / (b - a);
            if (at > 0.0 && at < 1.0) cuts.push_back(at);
        };
        const double u = (std::min(a, b) - low) / (high - low) * cells, v = (std::max(a, b) - low) / (high - low) * cells;
        if (u < 0.0) add(0.0);
        if (v > cells) add(cells);
        for (int i = int(std::ceil(std::max(u, 0.0) - shift)); i + shift <= std::min(v, double(cells)); ++i) add(i + shift);
    }

    // inside a no-fly area, or almost on its edge
    bool is_closed(Point p) const {
        bool inside = false;
        for (const auto& [a, b] : edges) {
            const double dx = b.x - a.x, dy = b.y - a.y;
            const double t = between(0.0, ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy), 1.0);
            if (std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy) < NEAR * side) return true;
            if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * dx / dy) inside = !inside;
        }
        return inside;
    }

    // cut a segment at all edges, and look at the middle of each part
    bool crosses(Point p, Point q) const {
        std::vector<double> cuts = {0.0, 1.0};
        const double px = q.x - p.x, py = q.y - p.y;
        for (const auto& [a, b] : edges) {
            if (std::max(a.x, b.x) < std::min(p.x, q.x) || std::max(p.x, q.x) < std::min(a.x, b.x)) continue;
            if (std::max(a.y, b.y) < std::min(p.y, q.y) || std::max(p.y, q.y) < std::min(a.y, b.y)) continue;
            const double dx = b.x - a.x, dy = b.y - a.y, turn = px * dy - py * dx;
            if (turn == 0.0) continue;
            const double along = ((a.x - p.x) * dy - (a.y - p.y) * dx) / turn;
            const double across = ((a.x - p.x) * py - (a.y - p.y) * px) / turn;
            if (along > 0.0 && along < 1.0 && across >= -NEAR && across <= 1.0 + NEAR) cuts.push_back(along);
        }
        std::sort(cuts.begin(), cuts.end());
        for (size_t i = 0; i + 1 < cuts.size(); ++i) {
            const double t = 0.5 * (cuts[i] + cuts[i + 1]);
            if (is_closed({p.x + t * px, p.y + t * py})) return true;
        }
        return false;
    }
};

// ---- question and answer ----

using Path = std::vector<Point>;

inline Map read_problem() {
    const std::string text((std::istreambuf_iterator<char>(std::cin)), std::istreambuf_iterator<char>());
    return Map(Reader{text.c_str()}.value());
}

inline void print_path(const Path& path) {
    if (path.empty()) std::fputs("null", stdout);
    // 17 digits: a number comes back as it was
    for (size_t i = 0; i < path.size(); ++i) std::printf("%s[%.17g, %.17g]", i ? ", " : "[", path[i].x, path[i].y);
    if (!path.empty()) std::fputs("]", stdout);
}

inline void answer(const Path& path) {
    std::fputs("{\"path\": ", stdout);
    print_path(path);
    std::puts("}");
}
