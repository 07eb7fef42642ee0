!> The bodies of a scene as its report tells them, and the waves in them.
module emcon_report_bodies
   use emcon_csr, only : csr_t
   use emcon_kinds, only : wp
   use emcon_law, only : law_response_plane, law_response_t
   use emcon_law_registry, only : law_anisotropic, law_user, law_row, law_row_t, n_law_row
   use emcon_locking, only : locking_ratio
   use emcon_report_row, only : report_row_t, report_rows_t, row_begin, row_put, rows_add
   use emcon_rotation, only : n_turn
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_inertia
   use emcon_solid, only : solid_t
   use emcon_stepper, only : stepper_t
   use emcon_term_registry, only : terms_mass, terms_solid
   implicit none
   private
   public :: body_t, bodies_find, bodies_rows

   !> A connected part of the mesh.
   type :: body_t
      integer :: n_element = 0
      integer :: n_rigid = 0                     !! elements that are part of a rigid body
      integer :: n_linear = 0                    !! elements with small strains in all steps
      integer :: n_corotated = 0                 !! and in frames that turn
      integer :: n_static = 0                    !! elements without inertia
      integer :: n_unknown = 0                   !! of the present step
      integer :: kind = 0                        !! of its elements; < 0: several
      integer :: law = 0                         !! code of its law; < 0: several
      real(wp), allocatable :: low(:), high(:)   !! (n_dim) corners of the box around it [L]
      real(wp) :: apart = huge(1.0_wp)           !! two nodes of an element, the least distance [L]
      real(wp) :: mass = 0.0_wp                  !! [M]
      real(wp), allocatable :: center(:)         !! (n_dim) of mass [L]
      !> (1 or 3) about the axes through the centre: z in the plane, x, y and z [M L^2]
      real(wp), allocatable :: inertia(:)
      real(wp) :: modulus = 0.0_wp               !! of pressure waves, the largest [M/(L T^2)]
      real(wp) :: ratio = 0.0_wp                 !! Poisson's, the largest of what locks
      real(wp) :: speed = 0.0_wp                 !! of pressure waves, the largest [L/T]
      real(wp) :: transit = huge(1.0_wp)         !! of a wave between two nodes, the shortest [T]
   end type body_t

contains

   !> The bodies of the model that `stepper` holds.
   subroutine bodies_find(stepper, body)
      type(stepper_t), intent(in), target :: stepper
      type(body_t), allocatable, intent(out) :: body(:)
      type(solid_t), pointer :: solid
      integer :: e, i, a

      solid => terms_solid(stepper%march%system%term)
      associate (scene => stepper%scene, space => stepper%march%system%space)
         allocate(body(space%n_body))
         do e = 1, size(scene%element%kind)
            i = space%body(scene%element%node(1, e))
            if (i > 0) call add_element(body(i), scene, solid, e)
         end do
         do i = 1, size(scene%x, 2)
            if (space%body(i) == 0) cycle
            do a = 1, scene%n_dim
               if (space%numbering%unknown(a, i) > 0) body(space%body(i))%n_unknown = &
                  body(space%body(i))%n_unknown + 1
            end do
         end do
         call add_masses(stepper, body)
      end associate
   end subroutine bodies_find

   subroutine add_element(body, scene, solid, e)
      type(body_t), intent(inout) :: body
      type(scene_t), intent(in) :: scene
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: e
      type(law_response_t) :: response
      real(wp) :: speed, modulus
      real(wp), parameter :: rest(3) = 0.0_wp

      body%n_element = body%n_element + 1
      if (solid%trait%is_rigid(e)) body%n_rigid = body%n_rigid + 1
      if (solid%trait%is_linear(e)) body%n_linear = body%n_linear + 1
      if (solid%trait%is_corotated(e)) body%n_corotated = body%n_corotated + 1
      if (.not. solid%trait%has_inertia(e)) body%n_static = body%n_static + 1
      call add_place(body, scene, e)
      call unite(body%kind, scene%element%kind(e))
      associate (material => scene%material(scene%section(scene%element%section(e))%material))
         call unite(body%law, material%law)
         if (.not. allocated(solid%law(solid%law_of(e))%law)) return
         associate (law => solid%law(solid%law_of(e))%law)
            call law_response_plane(law, rest, rest, response)
            modulus = 2.0_wp*response%tangent(1, 1)   ! by the end of a step of no size: a half
            body%ratio = max(body%ratio, locking_ratio(solid, e))
            if (.not. (modulus > 0.0_wp .and. material%density > 0.0_wp)) return
            body%modulus = max(body%modulus, modulus)
         end associate
         speed = sqrt(modulus/material%density)
      end associate
      body%speed = max(body%speed, speed)
      body%transit = min(body%transit, shortest(scene, e)/speed)
   end subroutine add_element

   !> The box and the least distance of nodes, with those of an element.
   pure subroutine add_place(body, scene, e)
      type(body_t), intent(inout) :: body
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      integer :: i

      associate (node => scene%element%node(:, e))
         if (.not. allocated(body%low)) then
            body%low = scene%x(:, node(1))
            body%high = body%low
         end if
         do i = 1, count(node > 0)
            body%low = min(body%low, scene%x(:, node(i)))
            body%high = max(body%high, scene%x(:, node(i)))
         end do
      end associate
      body%apart = min(body%apart, shortest(scene, e))
   end subroutine add_place

   !> One code for all, or < 0 for several.
   pure subroutine unite(code, other)
      integer, intent(inout) :: code
      integer, intent(in) :: other

      if (code == 0) code = other
      if (code /= other) code = -1
   end subroutine unite

   !> The smallest distance of two nodes of an element [L].
   pure real(wp) function shortest(scene, e)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      integer :: i, j

      shortest = huge(1.0_wp)
      associate (node => scene%element%node(:, e))
         do i = 1, count(node > 0)
            do j = 1, i - 1
               shortest = min(shortest, norm2(scene%x(:, node(i)) - scene%x(:, node(j))))
            end do
         end do
      end associate
   end function shortest

   !> Mass, its centre, its moment of inertia.
   subroutine add_masses(stepper, body)
      type(stepper_t), intent(in) :: stepper
      type(body_t), intent(inout) :: body(:)
      type(csr_t) :: mass
      real(wp) :: m
      integer :: i, k, b, n

      call terms_mass(stepper%march%system%term, mass)
      do b = 1, size(body)
         n = stepper%scene%n_dim
         allocate(body(b)%center(n), body(b)%inertia(n_turn(n)), source=0.0_wp)
      end do
      associate (x => stepper%scene%x)
         do i = 1, mass%n_row
            b = stepper%march%system%space%body(i)
            do k = mass%row_start(i) + 1, mass%row_start(i + 1)
               if (b == 0) cycle
               m = real(mass%value(k), wp)
               body(b)%mass = body(b)%mass + m
               body(b)%center = body(b)%center + m*x(:, i)
               body(b)%inertia = body(b)%inertia &
                  + scene_inertia(stepper%scene, m, x(:, i), x(:, mass%column(k) + 1))
            end do
         end do
      end associate
      do b = 1, size(body)
         if (.not. body(b)%mass > 0.0_wp) cycle
         body(b)%center = body(b)%center/body(b)%mass
         associate (has_motion => stepper%march%system%space%has_motion)
            where (.not. has_motion(:size(body(b)%center))) body(b)%center = 0.0_wp
         end associate
         body(b)%inertia = max(0.0_wp, body(b)%inertia - scene_inertia(stepper%scene, &
            body(b)%mass, body(b)%center, body(b)%center))
      end do
   end subroutine add_masses

   !> A row for each body.
   subroutine bodies_rows(scene, body, rows)
      type(scene_t), intent(in) :: scene
      type(body_t), intent(in) :: body(:)
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      character(len=:), allocatable :: kind, name
      integer :: i

      do i = 1, size(body)
         call row_begin(row, "bodies", "body")
         call row_put(row, "number", i, " #")
         call name_kind(scene, body(i), kind)
         call row_put(row, "elements", body(i)%n_element, ": #")
         call row_put(row, "kind", kind, " #")
         call row_put(row, "unknowns", body(i)%n_unknown, ", # unknowns")
         call name_law(body(i), name)
         call row_put(row, "law", name, ", #")
         call name_kinematics(body(i), name)
         call row_put(row, "kinematics", name, ", #")
         call put_place(body(i), row)
         call row_put(row, "mass", body(i)%mass, ", mass #")
         if (body(i)%mass > 0.0_wp) call put_inertia(body(i), row)
         if (body(i)%speed > 0.0_wp .and. body(i)%n_rigid < body(i)%n_element) then
            call row_put(row, "wave_speed", body(i)%speed, ", wave speed #")
            call row_put(row, "shortest_transit", body(i)%transit, &
               ", wave transit time of the smallest element #")
         end if
         call rows_add(rows, row)
      end do
   end subroutine bodies_rows

   subroutine put_place(body, row)
      type(body_t), intent(in) :: body
      type(report_row_t), intent(inout) :: row
      character(len=*), parameter :: axes = "xyz"
      integer :: a

      if (.not. allocated(body%low)) return
      do a = 1, size(body%low)
         call row_put(row, "low_" // axes(a:a), body%low(a), &
            trim(merge(", box from #", " #          ", a == 1)))
      end do
      do a = 1, size(body%high)
         call row_put(row, "high_" // axes(a:a), body%high(a), &
            trim(merge(" to #", " #   ", a == 1)))
      end do
      call row_put(row, "smallest_distance", body%apart, &
         ", smallest distance between nodes of an element #")
   end subroutine put_place

   subroutine put_inertia(body, row)
      type(body_t), intent(in) :: body
      type(report_row_t), intent(inout) :: row
      character(len=*), parameter :: axes = "xyz"
      integer :: a

      do a = 1, size(body%center)
         call row_put(row, "center_" // axes(a:a), body%center(a), &
            trim(merge(", centre #", " #        ", a == 1)))
      end do
      if (size(body%inertia) == 1) then
         call row_put(row, "inertia", body%inertia(1), ", moment of inertia #")
         return
      end if
      do a = 1, size(body%inertia)
         call row_put(row, "inertia_" // axes(a:a), body%inertia(a), &
            trim(merge(", moments of inertia #", " #                    ", a == 1)))
      end do
   end subroutine put_inertia

   subroutine name_kind(scene, body, name)
      type(scene_t), intent(in) :: scene
      type(body_t), intent(in) :: body
      character(len=:), allocatable, intent(out) :: name

      name = "elements of several kinds"
      if (body%kind > 0) name = trim(scene%element%kinds(body%kind)%name)
      if (body%kind == 0) name = "elements"
   end subroutine name_kind

   subroutine name_law(body, name)
      type(body_t), intent(in) :: body
      character(len=:), allocatable, intent(out) :: name
      type(law_row_t) :: row
      integer :: i

      name = "several laws"
      if (body%law == 0) name = "no law"
      do i = n_law_row(), 1, -1
         row = law_row(i)
         if (row%code == body%law) name = trim(row%name)
      end do
      if (body%law == law_user) name = "given law"
      if (body%law == law_anisotropic) name = "anisotropic"
   end subroutine name_law

   subroutine name_kinematics(body, name)
      type(body_t), intent(in) :: body
      character(len=:), allocatable, intent(out) :: name

      name = "large displacements in steps with NLGEOM"
      if (body%n_linear > 0) name = "linear in part"
      if (body%n_linear == body%n_element) name = "linear"
      if (body%n_corotated > 0) name = "corotated in part"
      if (body%n_corotated == body%n_element) name = "corotated"
      if (body%n_static > 0) then
         name = name // ", without inertia"
         if (body%n_static < body%n_element) name = name // " in part"
      end if
      if (body%n_rigid > 0) name = "rigid in part"
      if (body%n_rigid == body%n_element) name = "rigid"
   end subroutine name_kinematics

end module emcon_report_bodies
