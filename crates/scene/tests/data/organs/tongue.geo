// A tongue: an ellipsoid on a root, which is held; lengths in m. `gmsh -3 tongue.geo` writes tongue.msh (Gmsh 4.8.4).
SetFactory("OpenCASCADE");
Mesh.MeshSizeMax = 0.02;
Mesh.MeshSizeMin = 0.008;
Mesh.MeshSizeFromCurvature = 5;
Mesh.ElementOrder = 2;
Mesh.HighOrderOptimize = 2;
Sphere(1) = {0, 0, 0, 1};
Dilate{{0, 0, 0}, {0.045, 0.022, 0.02}}{ Volume{1}; }
Box(2) = {-0.03, -0.015, -0.03, 0.05, 0.03, 0.03};
BooleanUnion(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
held() = Surface In BoundingBox{-0.2, -0.2, -0.0301, 0.2, 0.2, -0.0299};
Physical Volume("tissue") = {3};
Physical Surface("held") = {held()};
free() = CombinedBoundary{ Volume{3}; };
free() -= held();
Physical Surface("free") = {free()};
