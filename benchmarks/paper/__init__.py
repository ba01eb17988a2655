"""The paper's simulations: its methods and Lariat's, on its rod and on Lariat's."""
